#pragma once

#include "camvox/import/import_report.hpp"

namespace camvox::import {

struct KittiRawOptions : ImportOptions {
  std::string drive;  ///< Folder of the drive inside the date's; may be empty if there is one.
  int camera = 2;     ///< 0, 1: grey left, right; 2, 3: colour left, right.
};

/// Imports one drive of KITTI raw, synced and rectified (Geiger et al., "Vision meets robotics: The
/// KITTI dataset", IJRR 2013). `folder` is that of the date, with the calibration, or that of the
/// drive inside it.
///
/// | topic | from |
/// | --- | --- |
/// | /camera/image_raw/compressed | image_0N, the files as they are (PNG, or JPEG) |
/// | /camera/camera_info | P_rect_0N and S_rect_0N: no distortion |
/// | /velodyne_points | x y z intensity, and `time`: seconds after the message's stamp |
/// | /imu/data, /gnss/fix | OXTS |
/// | /ground_truth/odometry | OXTS: base_link in `map` (east, north, up; origin: first fix) |
/// | /tf_static | base_link = imu_link -> velodyne -> camera_optical_frame |
///
/// Beside them rig.yaml, for `camvox run --parameters`: body = IMU.
///
/// A cloud is stamped with the start of its sweep and logged at its end, as a driver sends it. The
/// time of a point is derived from its azimuth: see `sweep_time_ns`. Positions are OXTS latitudes
/// and longitudes under the Mercator projection of KITTI's development kit. Time stamps carry no
/// zone and are read as UTC.
storage::Result<ImportReport> import_kitti_raw(const std::filesystem::path& folder,
                                               const KittiRawOptions& options);

/// When the sweep begins and ends, and when it looks forward.
struct SweepTimes {
  std::int64_t start_ns = 0;
  std::int64_t forward_ns = 0;
  std::int64_t end_ns = 0;
};

/// When the scanner looked at azimuth atan2(y, x): a sweep starts behind the car, turns clockwise
/// as seen from above, by the left side (azimuth +pi to 0), is at azimuth 0 at `forward_ns`, and
/// goes on by the right side, at an even rate in each half. Nanoseconds after `start_ns`. The sense
/// of the turn is stated both ways in public; on drive 0013 this one makes deskewed sweeps agree
/// best (a test shows it), and KISS-ICP and CT-ICP take it as well.
[[nodiscard]] std::int64_t sweep_time_ns(const SweepTimes& sweep, double azimuth_rad);

/// A geodetic position under the Mercator projection, with the scale of latitude `latitude0_deg`
/// (KITTI's development kit, convertOxtsToPose): metres east, north.
struct MercatorPosition {
  double east_m = 0.0;
  double north_m = 0.0;
};
[[nodiscard]] MercatorPosition mercator(double latitude_deg,
                                        double longitude_deg,
                                        double latitude0_deg);

}  // namespace camvox::import
