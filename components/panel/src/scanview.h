// A picture of a laser scan from above: the robot in the middle, ahead is up.
#pragma once

#include <QWidget>

#include "interfaces/RoboCompLaser.h"

class ScanView : public QWidget {
  Q_OBJECT

 public:
  explicit ScanView(QWidget* parent) : QWidget(parent) { setMinimumSize(200, 200); }

  // Shows a scan up to a distance, with lengths in millimetres and angles in radians.
  void show_scan(const RoboCompLaser::TLaserData& scan, double range);

 signals:
  void clicked();

 protected:
  void mousePressEvent(QMouseEvent* event) override;
  void paintEvent(QPaintEvent* event) override;

 private:
  RoboCompLaser::TLaserData scan_;
  // The distance at the edge of the picture.
  double range_ = 1;
};
