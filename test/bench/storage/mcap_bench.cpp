/// How fast recordings are written, read and searched, against what `cat` moves on the same machine
/// in the same run: every round measures all of them, one after the other, page cache warm.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <random>

#include "camvox/storage/indexed_reader.hpp"
#include "camvox/storage/stream_reader.hpp"
#include "camvox/storage/writer.hpp"

namespace {

using namespace camvox::storage;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kImageSize = 1520 * 568 * 3;
constexpr std::uint32_t kImages = 200;

void require(const Status& status) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s\n", status.message().c_str());
  std::exit(1);
}

double seconds_of(const std::function<void()>& work) {
  const auto start = Clock::now();
  work();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// A scene with edges, smooth parts and two bits of sensor noise: neither noise nor a constant.
std::string make_image(unsigned seed) {
  std::mt19937 random(seed);
  std::string image(kImageSize, '\0');
  for (std::size_t i = 0; i < image.size(); ++i) {
    const std::size_t column = i / 3 % 1520;
    const std::size_t row = i / 3 / 1520;
    image[i] = static_cast<char>((column / 40 * 9 + row / 30 * 5 + column / 8 + (random() & 3U)));
  }
  return image;
}

void write_images(const std::filesystem::path& path,
                  const std::vector<std::string>& images,
                  Compression compression) {
  McapWriterOptions options;
  options.compression = compression;
  McapWriter writer(options);
  auto sink = FileSink::create(path);
  require(sink.status());
  require(writer.open(std::move(*sink)));
  require(writer.add_channel(Channel{1, 0, "/camera/image_raw", "cdr", {}}));
  for (std::uint32_t i = 0; i < kImages; ++i) {
    const std::uint64_t time_ns = i * 100'000'000ULL;
    require(writer.write(Message{1, i, time_ns, time_ns, as_bytes(images[i % images.size()])}));
  }
  require(writer.close());
}

/// What `cat FROM > TO` does.
void cat(const std::filesystem::path& from, const char* to) {
  static std::vector<char> buffer(128 * 1024);
  const int in = ::open(from.c_str(), O_RDONLY);                   // NOLINT
  const int out = ::open(to, O_WRONLY | O_CREAT | O_TRUNC, 0644);  // NOLINT
  for (ssize_t n = 0; (n = ::read(in, buffer.data(), buffer.size())) > 0;) {
    if (::write(out, buffer.data(), static_cast<std::size_t>(n)) != n) std::exit(1);
  }
  ::close(in);
  ::close(out);
}

std::uint64_t stream(const std::filesystem::path& path) {
  const auto source = FileSource::open(path);
  require(source.status());
  McapStreamReader reader(**source);
  std::uint64_t size = 0;
  while (const Record* record = reader.next()) {
    if (const auto* message = std::get_if<Message>(record)) size += message->data.size();
  }
  require(reader.status());
  return size;
}

std::uint64_t read_by_index(const std::filesystem::path& path) {
  const auto reader = McapIndexedReader::open(path);
  require(reader.status());
  auto cursor = (*reader)->messages();
  std::uint64_t size = 0;
  while (const Message* message = cursor.next()) size += message->data.size();
  require(cursor.status());
  return size;
}

/// Only the decompressor: chunks are taken out of the file beforehand.
double decompress_only(const std::filesystem::path& path) {
  const auto source = FileSource::open(path);
  require(source.status());
  McapStreamReader reader(**source, {.limits = {}, .verify_crc = false, .expand_chunks = false});
  Decompressor decompressor;
  ByteBuffer out;
  double seconds = 0.0;
  while (const Record* record = reader.next()) {
    const auto* chunk = std::get_if<Chunk>(record);
    if (chunk == nullptr) continue;
    seconds += seconds_of([&] {
      require(decompressor.decompress(*parse_compression(chunk->compression),
                                      chunk->records,
                                      chunk->uncompressed_size,
                                      chunk->uncompressed_size,
                                      out));
    });
  }
  return seconds;
}

struct Series {
  const char* name;
  std::vector<double> seconds;
  double bytes = static_cast<double>(kImageSize) * kImages;
};

void print(const Series& series, const Series& reference) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < series.seconds.size(); ++i) {
    ratios.push_back(reference.seconds[i] / series.seconds[i]);
  }
  const auto [low, high] = std::minmax_element(ratios.begin(), ratios.end());
  std::printf("%-34s %7.2f GB/s   %4.0f %% of %s (%.0f to %.0f %%)\n",
              series.name,
              series.bytes / median(series.seconds) / 1e9,
              100 * median(ratios),
              reference.name,
              100 * *low,
              100 * *high);
}

void bench_throughput(const std::filesystem::path& folder, int rounds) {
  std::vector<std::string> images;
  for (unsigned i = 0; i < 8; ++i) images.push_back(make_image(i));
  const auto plain = folder / "plain.mcap";
  const auto lz4 = folder / "lz4.mcap";
  const auto zstd = folder / "zstd.mcap";
  const auto copy = folder / "copy.mcap";
  write_images(plain, images, Compression::kNone);
  write_images(lz4, images, Compression::kLz4);
  write_images(zstd, images, Compression::kZstd);
  Series cat_copy{"cat FILE > FILE", {}}, cat_null{"cat FILE > /dev/null", {}};
  Series write{"write, all CRCs", {}}, streamed{"read, streamed, CRCs checked", {}};
  Series indexed{"read, by index, CRCs checked", {}};
  Series lz4_all{"read lz4", {}}, lz4_only{"LZ4 alone", {}};
  Series zstd_all{"read zstd", {}}, zstd_only{"zstd alone", {}};
  for (int round = 0; round < rounds; ++round) {
    // Both write over a file that exists, so that freeing its pages counts for both.
    cat_copy.seconds.push_back(seconds_of([&] { cat(plain, copy.c_str()); }));
    write.seconds.push_back(seconds_of([&] { write_images(copy, images, Compression::kNone); }));
    cat_null.seconds.push_back(seconds_of([&] { cat(plain, "/dev/null"); }));
    streamed.seconds.push_back(seconds_of([&] { stream(plain); }));
    indexed.seconds.push_back(seconds_of([&] { read_by_index(plain); }));
    lz4_all.seconds.push_back(seconds_of([&] { read_by_index(lz4); }));
    lz4_only.seconds.push_back(decompress_only(lz4));
    zstd_all.seconds.push_back(seconds_of([&] { read_by_index(zstd); }));
    zstd_only.seconds.push_back(decompress_only(zstd));
  }
  std::printf("%u images of %.2f MB, %d rounds: median (lowest to highest round)\n",
              kImages,
              static_cast<double>(kImageSize) / 1e6,
              rounds);
  print(cat_copy, cat_copy);
  print(write, cat_copy);
  print(cat_null, cat_null);
  print(streamed, cat_null);
  print(indexed, cat_null);
  print(lz4_all, lz4_only);
  print(zstd_all, zstd_only);
}

/// Leaves holes for parts that are all zero: a file of 10 GB takes a few MB.
class SparseSink final : public Sink {
 public:
  explicit SparseSink(const std::filesystem::path& path)
      : descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644)) {}  // NOLINT
  ~SparseSink() override { ::close(descriptor_); }
  Status write(std::span<const Bytes> parts) override {
    for (const Bytes part : parts) {
      const bool hole = part.size() > 100'000 && part[0] == std::byte{0};
      const bool done = hole ? ::lseek(descriptor_, static_cast<off_t>(part.size()), SEEK_CUR) >= 0
                             : ::write(descriptor_, part.data(), part.size()) >= 0;
      if (!done) return {StatusCode::kIo, "cannot write the sparse file"};
    }
    return {};
  }
  Status flush() override { return {}; }
  Status close() override { return {}; }

 private:
  int descriptor_;
};

void bench_lookup(const std::filesystem::path& folder) {
  constexpr std::uint32_t kMessages = 10'000;
  const auto path = folder / "sparse.mcap";
  {
    const std::string zeros(1 << 20, '\0');
    McapWriter writer;
    require(writer.open(std::make_unique<SparseSink>(path)));
    require(writer.add_channel(Channel{1, 0, "/camera/image_raw", "cdr", {}}));
    for (std::uint32_t i = 0; i < kMessages; ++i) {
      require(writer.write(Message{1, i, i * 1000ULL, i * 1000ULL, as_bytes(zeros)}));
    }
    require(writer.close());
  }
  std::vector<double> open_ms, lookup_ms;
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    std::unique_ptr<McapIndexedReader> reader;
    open_ms.push_back(1e3 * seconds_of([&] {
                        auto opened = McapIndexedReader::open(path);
                        require(opened.status());
                        reader = std::move(*opened);
                      }));
    const std::uint64_t wanted = random() % kMessages;
    lookup_ms.push_back(1e3 * seconds_of([&] {
                          auto cursor =
                              reader->messages({.start_time_ns = wanted * 1000, .topics = {}});
                          const Message* message = cursor.next();
                          if (message == nullptr || message->sequence != wanted) std::exit(1);
                        }));
  }
  std::printf("%.1f GB, %u chunks: open %.2f ms, first message from a time %.2f ms (worst %.2f)\n",
              static_cast<double>(std::filesystem::file_size(path)) / 1e9,
              kMessages,
              median(open_ms),
              median(lookup_ms),
              *std::max_element(lookup_ms.begin(), lookup_ms.end()));
}

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path base =
      argc > 1 ? std::filesystem::path(argv[1]) : std::filesystem::temp_directory_path();
  const auto folder = base / "camvox_mcap_bench";
  std::filesystem::create_directories(folder);
  bench_throughput(folder, argc > 2 ? std::atoi(argv[2]) : 9);
  bench_lookup(folder);
  std::filesystem::remove_all(folder);
  return 0;
}
