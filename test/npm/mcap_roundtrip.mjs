// The other side of mcap_npm_test.cpp: reads or writes an MCAP file with @mcap/core and
// @foxglove/rosmsg2-serialization, and prints every field of every message in the form that the
// C++ side prints, so that the two texts can be compared.
//   node mcap_roundtrip.mjs read FILE
//   node mcap_roundtrip.mjs write FILE SCHEMA_FOLDER COMPRESSION
import { open, readFile, writeFile } from "node:fs/promises";
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";
import lz4 from "@foxglove/wasm-lz4";
import zstd from "@foxglove/wasm-zstd";
import { McapIndexedReader, McapStreamReader, McapWriter } from "@mcap/core";

const hex = (buffer) => Buffer.from(buffer).toString("hex");

function bitsOf(number) {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, Number(number));
  return hex(view.buffer);
}

function flatten(path, value, out) {
  if (typeof value === "string") out.push(`${path}="${hex(Buffer.from(value, "utf8"))}"`);
  else if (typeof value === "boolean") out.push(`${path}=${bitsOf(value ? 1 : 0)}`);
  else if (typeof value === "number" || typeof value === "bigint") out.push(`${path}=${bitsOf(value)}`);
  else if (ArrayBuffer.isView(value) || Array.isArray(value)) {
    out.push(`${path}#${value.length}`);
    value.forEach((element, index) => flatten(`${path}[${index}]`, element, out));
  } else {
    for (const [key, member] of Object.entries(value)) {
      flatten(`${path}.${key === "nsec" ? "nanosec" : key}`, member, out);
    }
  }
}

function line(topic, message, decoded) {
  const out = [];
  flatten("", decoded, out);
  return `${topic} ${message.sequence} ${message.logTime} ${message.publishTime} ${out.join(" ")}`;
}

const definitionsOf = (text) => parse(text, { ros2: true });

async function read(path) {
  await lz4.isLoaded;
  await zstd.isLoaded;
  const bytes = await readFile(path);
  const decompressHandlers = {
    lz4: (buffer, size) => lz4(buffer, Number(size)),
    zstd: (buffer, size) => zstd.decompress(buffer, Number(size)),
  };
  // Every CRC of the file is checked by the streamed reader.
  const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  stream.append(bytes);
  let streamed = 0;
  for (let record; (record = stream.nextRecord()); ) if (record.type === "Message") ++streamed;
  if (!stream.done()) throw new Error("the streamed reader did not reach the end");

  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const decoders = new Map();
  for (const [id, schema] of reader.schemasById) {
    decoders.set(id, new MessageReader(definitionsOf(new TextDecoder().decode(schema.data))));
  }
  let indexed = 0;
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    const decoded = decoders.get(channel.schemaId).readMessage(message.data);
    console.log(line(channel.topic, message, decoded));
    ++indexed;
  }
  if (streamed !== indexed) throw new Error(`${streamed} messages streamed, ${indexed} indexed`);
}

const kSchemas = { "/imu": "sensor_msgs/msg/Imu", "/image": "sensor_msgs/msg/Image", "/tf": "tf2_msgs/msg/TFMessage" };

const vector = (seed) => ({ x: seed + 0.25, y: -seed / 3, z: seed * 1e-9 });
const rotation = (seed) => ({ x: 0.1, y: seed / 7, z: -0, w: 1 });
const header = (i) => ({ stamp: { sec: 1700000000 + i, nanosec: 999999999 - i }, frame_id: `frame_é_${i}` });
const covariance = (seed) => Float64Array.from({ length: 9 }, (_, k) => seed + k / 11);

function messageOf(topic, i) {
  if (topic === "/imu") {
    return {
      header: header(i), orientation: rotation(i), orientation_covariance: covariance(i),
      angular_velocity: vector(i), angular_velocity_covariance: covariance(-i),
      linear_acceleration: vector(-i), linear_acceleration_covariance: covariance(2 * i),
    };
  }
  if (topic === "/image") {
    return {
      header: header(i), height: 4, width: i, encoding: "mono8", is_bigendian: 0, step: i,
      data: Uint8Array.from({ length: 4 * i }, (_, k) => (k * 37 + i) & 255),
    };
  }
  return {
    transforms: Array.from({ length: i % 4 }, (_, k) => ({
      header: header(i + k), child_frame_id: "c".repeat(k),
      transform: { translation: vector(k), rotation: rotation(k) },
    })),
  };
}

async function write(path, schemaFolder, compression) {
  await zstd.isLoaded;
  const file = await open(path, "w");
  let position = 0n;
  const writable = {
    position: () => position,
    write: async (buffer) => {
      await file.write(buffer);
      position += BigInt(buffer.length);
    },
  };
  const compressChunk = compression === "zstd"
    ? (data) => ({ compression: "zstd", compressedData: zstd.compress(data) }) : undefined;
  const writer = new McapWriter({ writable, compressChunk, chunkSize: 2000 });
  await writer.start({ profile: "ros2", library: "test" });
  const channels = [];
  for (const [topic, name] of Object.entries(kSchemas)) {
    const text = await readFile(`${schemaFolder}/${name.replaceAll("/", "_")}.txt`, "utf8");
    const schemaId = await writer.registerSchema({ name, encoding: "ros2msg", data: Buffer.from(text) });
    const id = await writer.registerChannel({ topic, schemaId, messageEncoding: "cdr", metadata: new Map() });
    channels.push({ topic, id, encoder: new MessageWriter(definitionsOf(text)), decoder: new MessageReader(definitionsOf(text)) });
  }
  for (let i = 0; i < 60; ++i) {
    const { topic, id, encoder, decoder } = channels[i % 3];
    const data = encoder.writeMessage(messageOf(topic, i));
    const message = { channelId: id, sequence: i, logTime: BigInt(1e18 + i * 1000), publishTime: BigInt(i), data };
    await writer.addMessage(message);
    console.log(line(topic, message, decoder.readMessage(data)));
  }
  await writer.end();
  await file.close();
}

const [, , verb, ...rest] = process.argv;
await (verb === "read" ? read(...rest) : write(...rest));
