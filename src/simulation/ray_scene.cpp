#include "camvox/simulation/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace camvox::simulation {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kPacket = 16;
/// Nearer surfaces are not seen; keeps a sensor from seeing what it is mounted on.
constexpr float kNear = 0.02f;

RTCScene make_mesh_scene(RTCDevice device, const Mesh& mesh) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  if (!mesh.triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry,
                                                                 RTC_BUFFER_TYPE_VERTEX,
                                                                 0,
                                                                 RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float),
                                                                 mesh.vertices.size()));
    for (const Vector3f& vertex : mesh.vertices) vertices = std::copy_n(vertex.data(), 3, vertices);
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry,
                                                                        RTC_BUFFER_TYPE_INDEX,
                                                                        0,
                                                                        RTC_FORMAT_UINT3,
                                                                        3 * sizeof(std::uint32_t),
                                                                        mesh.triangles.size()));
    for (const auto& triangle : mesh.triangles) {
      indices = std::copy(triangle.begin(), triangle.end(), indices);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene);
  return scene;
}

/// Adds `mesh_scene` to `scene` under the next identifier and lets go of it.
RTCGeometry add_instance(RTCDevice device, RTCScene scene, RTCScene mesh_scene, unsigned steps) {
  RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, mesh_scene);
  rtcSetGeometryTimeStepCount(instance, steps);
  rtcCommitGeometry(instance);
  rtcAttachGeometry(scene, instance);
  rtcReleaseGeometry(instance);
  rtcReleaseScene(mesh_scene);
  return instance;  // Kept alive by the scene.
}

/// Copies up to 16 rays into Embree's layout; returns how many.
template <typename Packet>
std::size_t load(std::span<const Ray> rays, Packet& packet, int* valid) {
  const std::size_t count = std::min(rays.size(), kPacket);
  for (std::size_t i = 0; i < kPacket; ++i) {
    const Ray& ray = rays[std::min(i, count - 1)];
    valid[i] = i < count ? -1 : 0;
    packet.org_x[i] = ray.origin_world.x();
    packet.org_y[i] = ray.origin_world.y();
    packet.org_z[i] = ray.origin_world.z();
    packet.dir_x[i] = ray.direction_world.x();
    packet.dir_y[i] = ray.direction_world.y();
    packet.dir_z[i] = ray.direction_world.z();
    packet.tnear[i] = kNear;
    packet.tfar[i] = std::numeric_limits<float>::infinity();
    packet.time[i] = ray.time;
    packet.mask[i] = ~0u;
    packet.id[i] = static_cast<unsigned>(i);
    packet.flags[i] = 0;
  }
  return count;
}

Eigen::Matrix<float, 3, 4> placement(const MovingObject& object, double time_s) {
  const GroundPose pose = object.pose(time_s);
  Eigen::Matrix<float, 3, 4> T;
  T.leftCols<3>() = Eigen::AngleAxisf(pose.yaw_rad, Vector3f::UnitZ()).toRotationMatrix();
  T.col(3) << pose.position_world, object.ground_height_m;
  return T;
}

}  // namespace

struct RayScene::Implementation {
  const World* world;
  RTCDevice device;
  RTCScene scene;
  std::vector<RTCGeometry> instances;
  std::vector<Eigen::Matrix3f> rotations;  ///< Of the moving objects, in mid-interval.

  explicit Implementation(const World& of) : world(&of) {
    // One thread: a parallel build could order its nodes by chance, and with them exact ties.
    device = rtcNewDevice("threads=1,set_affinity=0");
    if (device == nullptr) {
      throw std::runtime_error("RayScene: Embree does not start, error " +
                               std::to_string(static_cast<int>(rtcGetDeviceError(nullptr))));
    }
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    add_instance(device, scene, make_mesh_scene(device, world->scenery), 1);
    for (const MovingObject& object : world->moving) {
      instances.push_back(add_instance(device, scene, make_mesh_scene(device, object.mesh), 2));
    }
    rotations.resize(instances.size());
  }
  ~Implementation() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
};

RayScene::RayScene(const World& world) : implementation_(std::make_unique<Implementation>(world)) {
  set_interval(0.0, 0.0);
}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

void RayScene::set_interval(double start_s, double end_s) {
  Implementation& own = *implementation_;
  for (std::size_t i = 0; i < own.instances.size(); ++i) {
    const MovingObject& object = own.world->moving[i];
    const auto before = placement(object, start_s);
    const auto after = placement(object, end_s);
    rtcSetGeometryTransform(own.instances[i], 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, before.data());
    rtcSetGeometryTransform(own.instances[i], 1, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, after.data());
    rtcCommitGeometry(own.instances[i]);
    own.rotations[i] = placement(object, 0.5 * (start_s + end_s)).leftCols<3>();
  }
  rtcCommitScene(own.scene);
}

void RayScene::intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  alignas(64) int valid[kPacket];
  RTCRayHit16 packet;
  while (!rays.empty()) {
    const std::size_t count = load(rays, packet.ray, valid);
    std::fill_n(packet.hit.geomID, kPacket, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(packet.hit.instID[0], kPacket, RTC_INVALID_GEOMETRY_ID);
    rtcIntersect16(valid, implementation_->scene, &context, &packet);
    for (std::size_t i = 0; i < count; ++i) {
      hits[i] = {};
      if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      hits[i] = {packet.ray.tfar[i],
                 packet.hit.instID[0][i],
                 packet.hit.primID[i],
                 packet.hit.u[i],
                 packet.hit.v[i]};
    }
    rays = rays.subspan(count);
    hits = hits.subspan(count);
  }
}

void RayScene::occluded(std::span<const Ray> rays, std::span<std::uint8_t> blocked) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  alignas(64) int valid[kPacket];
  RTCRay16 packet;
  while (!rays.empty()) {
    const std::size_t count = load(rays, packet, valid);
    rtcOccluded16(valid, implementation_->scene, &context, &packet);
    for (std::size_t i = 0; i < count; ++i) blocked[i] = packet.tfar[i] < 0.0f ? 1 : 0;
    rays = rays.subspan(count);
    blocked = blocked.subspan(count);
  }
}

Surface RayScene::surface(const Hit& hit) const {
  const World& world = *implementation_->world;
  const bool moves = hit.object > 0;
  const Mesh& mesh = moves ? world.moving[hit.object - 1].mesh : world.scenery;
  const auto& [a, b, c] = mesh.triangles[hit.triangle];
  const Vector3f& corner = mesh.vertices[a];
  const Vector3f normal = (mesh.vertices[b] - corner).cross(mesh.vertices[c] - corner).normalized();
  return {&world.materials[mesh.material_of[hit.triangle]],
          mesh.uv_m[a] * (1.0f - hit.u - hit.v) + mesh.uv_m[b] * hit.u + mesh.uv_m[c] * hit.v,
          moves ? Vector3f(implementation_->rotations[hit.object - 1] * normal) : normal};
}

}  // namespace camvox::simulation
