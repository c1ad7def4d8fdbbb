#include "specificworker.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace {

/// The colours of the discs: red, green, blue, yellow.
constexpr std::array<std::array<std::uint8_t, 3>, 4> COLOURS{
    {{220, 40, 40}, {40, 180, 60}, {40, 70, 220}, {230, 210, 40}}};
constexpr std::uint8_t GREY = 128;
/// How many pictures a disc takes to go round.
constexpr float ROUND = 300.0F;
constexpr float WHOLE_TURN = 6.2831853F;
/// Points in a row of the cloud.
constexpr std::size_t ROW = 100;

}  // namespace

void SpecificWorker::compute() {
  ++number_;
  auto image = ctx.camera_pub.loan_new_image();
  draw(*image);
  image.send();
  auto cloud = ctx.camera_pub.loan_new_cloud();
  scatter(*cloud);
  cloud.send();
}

RoboCompCamera::Image SpecificWorker::Camera_getImage() {
  RoboCompCamera::Image image;
  draw(image);
  return image;
}

std::int64_t SpecificWorker::captured() const {
  using std::chrono::nanoseconds;
  return std::chrono::duration_cast<nanoseconds>(std::chrono::steady_clock::now() - begun_).count();
}

template <class Image>
void SpecificWorker::draw(Image& image) const {
  using RoboCompCamera::PixelFormat;
  const int width = params.width;
  const int height = params.height;
  image.captured = captured();
  image.number = number_;
  image.width = width;
  image.height = height;
  image.frame = "camera";
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (params.discs > 0) {
    image.format = PixelFormat::Rgb;
    image.data.resize(3 * pixels);
    return colour(image.data.data(), width, height);
  }
  image.format = PixelFormat::Grey;
  image.data.resize(pixels);
  std::uint8_t* pixel = image.data.data();
  for (int row = 0; row < height; ++row) {
    auto value = static_cast<std::uint8_t>(number_ + row);
    for (int column = 0; column < width; ++column) *pixel++ = value++;
  }
}

void SpecificWorker::colour(std::uint8_t* data, int width, int height) const {
  std::fill_n(data, 3 * width * height, GREY);
  const float radius = static_cast<float>(std::min(width, height)) / 10.0F;
  for (int disc = 0; disc < params.discs; ++disc) {
    const float turns = static_cast<float>(number_) / ROUND +
                        static_cast<float>(disc) / static_cast<float>(params.discs);
    const float x = static_cast<float>(width) * (0.5F + 0.25F * std::cos(turns * WHOLE_TURN));
    const float y = static_cast<float>(height) * (0.5F + 0.25F * std::sin(turns * WHOLE_TURN));
    for (int row = 0; row < height; ++row) {
      const float away = static_cast<float>(row) + 0.5F - y;
      const float half = radius * radius - away * away;
      if (half <= 0.0F) continue;
      const auto first = std::clamp(static_cast<int>(std::round(x - std::sqrt(half))), 0, width);
      const auto last = std::clamp(static_cast<int>(std::round(x + std::sqrt(half))), 0, width);
      for (int column = first; column < last; ++column) {
        const auto& colour = COLOURS[static_cast<std::size_t>(disc)];
        std::copy(colour.begin(), colour.end(), data + 3 * (row * width + column));
      }
    }
  }
}

void SpecificWorker::scatter(RoboCompCamera::CloudInPlace& cloud) const {
  cloud.captured = captured();
  cloud.number = number_;
  cloud.points.resize(static_cast<std::size_t>(params.points));
  for (std::size_t at = 0; at < cloud.points.size(); ++at) {
    auto& point = cloud.points[at];
    point.x = static_cast<float>(at % ROW) * 10.0F - 500.0F;
    point.y = static_cast<float>(at / ROW) * 10.0F - 500.0F;
    point.z = 2000.0F + 50.0F * std::sin((point.x + static_cast<float>(number_)) / 100.0F);
  }
}
