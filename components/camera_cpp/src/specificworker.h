// Publishes a pattern that moves by one pixel with each picture, so that a subscriber can check a
// picture: the pixel at column x and row y of the picture n is x + y + n, as a byte.
//
// With discs, it publishes pictures in colour: discs on grey, which go round.
#pragma once

#include <chrono>

#include "genericworker.h"

class SpecificWorker final : public GenericWorker {
 public:
  void compute() override;

  RoboCompCamera::Image Camera_getImage() override;

 private:
  /// Writes the picture of this moment, into shared memory or into a value.
  template <class Image>
  void draw(Image& image) const;
  /// Writes the discs. Their centres go round on an ellipse of half the picture's size; a radius is a
  /// tenth of its shorter side.
  void colour(std::uint8_t* data, int width, int height) const;
  /// Writes a wall with waves.
  void scatter(RoboCompCamera::CloudInPlace& cloud) const;
  /// The time since the start, in ns.
  std::int64_t captured() const;

  /// The pictures so far.
  std::int64_t number_ = 0;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
};
