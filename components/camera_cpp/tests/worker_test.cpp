// The worker without subscribers or process.
#include "specificworker.h"
#include "testing.h"

namespace {

// The pixels of the picture `number`.
void check(const RoboCompCamera::Image& image, std::int64_t number) {
  RC_CHECK(image.number == number && image.width == 40 && image.height == 30);
  RC_CHECK(image.frame == "camera" && image.data.size() == 40 * 30);
  for (int row = 0; row < 30; ++row) {
    for (int column = 0; column < 40; ++column) {
      RC_CHECK(image.data[static_cast<std::size_t>(row * 40 + column)] ==
               static_cast<std::uint8_t>(number + row + column));
    }
  }
}

void pictures_move_and_clouds_have_their_points() {
  TestContext test;
  test.params.width = 40;
  test.params.height = 30;
  test.params.points = 250;
  auto& worker = test.start<SpecificWorker>();
  worker.compute();
  worker.compute();
  const auto images = test.camera_pub.new_image_samples();
  RC_CHECK(images.size() == 2);
  check(images[0], 1);
  check(images[1], 2);
  check(worker.Camera_getImage(), 2);
  const auto clouds = test.camera_pub.new_cloud_samples();
  RC_CHECK(clouds.size() == 2 && clouds[1].points.size() == 250);
  RC_CHECK(clouds[1].points[249].x == -10.0F && clouds[1].points[249].y == -480.0F);
}

void discs_go_round() {
  TestContext test;
  test.params.width = 100;
  test.params.height = 100;
  test.params.discs = 1;
  auto& worker = test.start<SpecificWorker>();
  worker.compute();
  const auto image = test.camera_pub.new_image_samples().back();
  RC_CHECK(image.format == RoboCompCamera::PixelFormat::Rgb && image.data.size() == 30000);
  const std::uint8_t* centre = &image.data[3 * (50 * 100 + 75)];
  RC_CHECK(centre[0] == 220 && centre[1] == 40 && image.data[0] == 128);
}

}  // namespace

int main() {
  return rc::run_test("pictures move and clouds have their points",
                      pictures_move_and_clouds_have_their_points) |
         rc::run_test("discs go round", discs_go_round);
}
