#include "camvox/sync/image_decoder.hpp"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace camvox::sync {
namespace {

using ::testing::HasSubstr;

/// Smooth colours with some texture; `width` may be odd.
cv::Mat test_image(int width_px = 97, int height_px = 63) {
  cv::Mat image(height_px, width_px, CV_8UC3);
  for (int v = 0; v < height_px; ++v) {
    for (int u = 0; u < width_px; ++u) {
      image.at<cv::Vec3b>(v, u) = {static_cast<std::uint8_t>(2 * u + 20),
                                   static_cast<std::uint8_t>(3 * v + 10),
                                   static_cast<std::uint8_t>(120 + 40 * std::sin(0.2 * u))};
    }
  }
  return image;
}

struct Decoded {
  std::string problem;
  std::vector<std::uint8_t> data;
};

template <typename Decode>
Decoded decode(const cv::Mat& like, PixelFormat format, Decode&& run) {
  Decoded result;
  result.data.assign(image_bytes(like.cols, like.rows, format) + 4, 0xee);
  const std::size_t size = result.data.size() - 4;
  result.problem = run(ImageTarget{{result.data.data(), size}, like.cols, like.rows, format});
  for (std::size_t i = size; i < size + 4; ++i) EXPECT_EQ(result.data[i], 0xee);
  return result;
}

double mean_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * a.channels());
}

cv::Mat grey_view(std::vector<std::uint8_t>& data, const cv::Mat& like, PixelFormat format) {
  return {like.rows, like.cols, CV_8UC1, data.data(), row_step_bytes(like.cols, format)};
}

/// BGR from the planes, each pixel with the chroma of its block.
cv::Mat colours_of(const std::vector<std::uint8_t>& data, const cv::Mat& like) {
  const int step = static_cast<int>(row_step_bytes(like.cols, PixelFormat::kYuv420));
  const int half = step / 2, rows = (like.rows + 1) / 2 * 2;
  cv::Mat bgr(like.size(), CV_8UC3);
  for (int v = 0; v < like.rows; ++v) {
    for (int u = 0; u < like.cols; ++u) {
      const double y = data[static_cast<std::size_t>(v * step + u)];
      const auto chroma = static_cast<std::size_t>(step * rows + v / 2 * half + u / 2);
      const double cb = data[chroma] - 128.0;
      const double cr = data[chroma + static_cast<std::size_t>(half * rows / 2)] - 128.0;
      bgr.at<cv::Vec3b>(v, u) = {cv::saturate_cast<std::uint8_t>(y + 1.772 * cb),
                                 cv::saturate_cast<std::uint8_t>(y - 0.344136 * cb - 0.714136 * cr),
                                 cv::saturate_cast<std::uint8_t>(y + 1.402 * cr)};
    }
  }
  return bgr;
}

class Compressed : public ::testing::TestWithParam<const char*> {};

TEST_P(Compressed, DecodesToGreyColourAndPlanes) {
  const cv::Mat image = test_image();
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  std::vector<std::uint8_t> bytes;
  cv::imencode(GetParam(), image, bytes, {cv::IMWRITE_JPEG_QUALITY, 98});
  ImageDecoder decoder;
  const auto run = [&](const ImageTarget& target) { return decoder.decode(bytes, target); };
  auto mono = decode(image, PixelFormat::kMono8, run);
  ASSERT_EQ(mono.problem, "");
  EXPECT_LT(mean_difference(grey_view(mono.data, image, PixelFormat::kMono8), grey), 1.0);
  auto bgr = decode(image, PixelFormat::kBgr8, run);
  ASSERT_EQ(bgr.problem, "");
  EXPECT_LT(mean_difference(cv::Mat(image.size(), CV_8UC3, bgr.data.data()), image), 2.0);
  auto yuv = decode(image, PixelFormat::kYuv420, run);
  ASSERT_EQ(yuv.problem, "");
  // The Y plane is what tracking sees: bit for bit the grey image.
  EXPECT_EQ(mean_difference(grey_view(yuv.data, image, PixelFormat::kYuv420),
                            grey_view(mono.data, image, PixelFormat::kMono8)),
            0.0);
  EXPECT_LT(mean_difference(colours_of(yuv.data, image), image), 3.0);  // halved chroma
}
INSTANTIATE_TEST_SUITE_P(Formats, Compressed, ::testing::Values(".jpg", ".png"));

TEST(ImageDecoder, DecodesGreyPng) {
  cv::Mat grey;
  cv::cvtColor(test_image(), grey, cv::COLOR_BGR2GRAY);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", grey, bytes);
  ImageDecoder decoder;
  auto mono = decode(grey, PixelFormat::kMono8, [&](const ImageTarget& target) {
    return decoder.decode(bytes, target);
  });
  ASSERT_EQ(mono.problem, "");
  EXPECT_EQ(mean_difference(grey_view(mono.data, grey, PixelFormat::kMono8), grey), 0.0);
}

TEST(ImageDecoder, RefusesDamagedAndForeignImages) {
  const cv::Mat image = test_image();
  ImageDecoder decoder;
  for (const char* format : {".jpg", ".png"}) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(format, image, bytes);
    const auto other = decode(test_image(96, 63), PixelFormat::kMono8, [&](const auto& target) {
      return decoder.decode(bytes, target);
    });
    EXPECT_THAT(other.problem, HasSubstr("97x63"));
    bytes.resize(bytes.size() / 2);
    const auto cut = decode(image, PixelFormat::kMono8, [&](const auto& target) {
      return decoder.decode(bytes, target);
    });
    EXPECT_NE(cut.problem, "") << format;
    bytes.resize(3);
    const auto stump = decode(image, PixelFormat::kMono8, [&](const auto& target) {
      return decoder.decode(bytes, target);
    });
    EXPECT_NE(stump.problem, "") << format;
  }
  const auto empty = decode(
      image, PixelFormat::kMono8, [&](const auto& target) { return decoder.decode({}, target); });
  EXPECT_THAT(empty.problem, HasSubstr("neither"));
}

TEST(ImageDecoder, RefusesWhatDoesNotFit) {
  std::vector<std::uint8_t> bytes, small(100);
  cv::imencode(".jpg", test_image(), bytes);
  ImageDecoder decoder;
  EXPECT_THAT(decoder.decode(bytes, {small, 97, 63, PixelFormat::kMono8}), HasSubstr("needs"));
}

Decoded convert(const cv::Mat& image, const std::string& encoding, PixelFormat format) {
  ImageDecoder decoder;
  return decode(image, format, [&](const ImageTarget& target) {
    return decoder.convert({encoding,
                            image.cols,
                            image.rows,
                            image.step,
                            {image.data, image.step * static_cast<std::size_t>(image.rows)}},
                           target);
  });
}

TEST(ImageDecoder, ConvertsRawColourOrders) {
  const cv::Mat bgr = test_image();
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  const std::map<std::string, int> codes = {
      {"rgb8", cv::COLOR_BGR2RGB}, {"bgra8", cv::COLOR_BGR2BGRA}, {"rgba8", cv::COLOR_BGR2RGBA}};
  for (const auto& [encoding, code] : codes) {
    cv::Mat image;
    cv::cvtColor(bgr, image, code);
    auto mono = convert(image, encoding, PixelFormat::kMono8);
    ASSERT_EQ(mono.problem, "");
    EXPECT_LE(mean_difference(grey_view(mono.data, bgr, PixelFormat::kMono8), grey), 0.01)
        << encoding;
    auto colour = convert(image, encoding, PixelFormat::kBgr8);
    EXPECT_EQ(mean_difference(cv::Mat(bgr.size(), CV_8UC3, colour.data.data()), bgr), 0.0);
    auto planes = convert(image, encoding, PixelFormat::kYuv420);
    EXPECT_LT(mean_difference(colours_of(planes.data, bgr), bgr), 3.0);
  }
}

TEST(ImageDecoder, KeepsGreyImagesAsTheyAreWhateverTheirRowStep) {
  cv::Mat wide(63, 128, CV_8UC1);
  cv::randu(wide, 0, 255);
  const cv::Mat grey = wide(cv::Rect(0, 0, 97, 63));
  auto mono = convert(grey, "mono8", PixelFormat::kMono8);
  ASSERT_EQ(mono.problem, "");
  EXPECT_EQ(mean_difference(grey_view(mono.data, grey, PixelFormat::kMono8), grey), 0.0);
  auto planes = convert(grey, "mono8", PixelFormat::kYuv420);
  EXPECT_LE(mean_difference(grey_view(planes.data, grey, PixelFormat::kYuv420), grey), 0.0);
}

TEST(ImageDecoder, BayerPatternsKeepTheirColours) {
  const cv::Mat blue(64, 96, CV_8UC3, cv::Scalar(200, 60, 20));
  const std::map<std::string, std::string> patterns = {{"bayer_rggb8", "rggb"},
                                                       {"bayer_bggr8", "bggr"},
                                                       {"bayer_gbrg8", "gbrg"},
                                                       {"bayer_grbg8", "grbg"}};
  for (const auto& [encoding, pattern] : patterns) {
    cv::Mat bayer(64, 96, CV_8UC1);
    for (int v = 0; v < 64; ++v) {
      for (int u = 0; u < 96; ++u) {
        const char colour = pattern[static_cast<std::size_t>(2 * (v % 2) + u % 2)];
        bayer.at<std::uint8_t>(v, u) = colour == 'b' ? 200 : (colour == 'g' ? 60 : 20);
      }
    }
    auto bgr = convert(bayer, encoding, PixelFormat::kBgr8);
    ASSERT_EQ(bgr.problem, "");
    EXPECT_LT(mean_difference(cv::Mat(64, 96, CV_8UC3, bgr.data.data()), blue), 1.0) << encoding;
  }
}

TEST(ImageDecoder, RefusesRawImagesThatDoNotAddUp) {
  cv::Mat grey(63, 97, CV_8UC1, cv::Scalar(5));
  EXPECT_THAT(convert(grey, "mono16", PixelFormat::kMono8).problem, HasSubstr("mono16"));
  EXPECT_THAT(convert(grey, "bgr8", PixelFormat::kMono8).problem, HasSubstr("fewer bytes"));
}

}  // namespace
}  // namespace camvox::sync
