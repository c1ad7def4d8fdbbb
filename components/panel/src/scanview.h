// A picture of a laser scan from above: the robot in the middle, ahead is up.
#pragma once

#include <QWidget>

#include "interfaces/RoboCompLaser.h"

class ScanView : public QWidget {
 public:
  explicit ScanView(QWidget* parent) : QWidget(parent) { setMinimumSize(200, 200); }

  // Shows a scan, with lengths in millimetres and angles in radians.
  void show_scan(const RoboCompLaser::TLaserData& scan);

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  RoboCompLaser::TLaserData scan_;
};
