#include "scanview.h"

#include <QPainter>
#include <QPolygonF>
#include <algorithm>
#include <cmath>

void ScanView::show_scan(const RoboCompLaser::TLaserData& scan, double range) {
  scan_ = scan;
  range_ = range;
  update();
}

void ScanView::mousePressEvent(QMouseEvent*) { emit clicked(); }

void ScanView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.fillRect(rect(), QColor(24, 28, 36));
  painter.translate(rect().center());
  const double scale = std::min(width(), height()) / (2 * range_);
  QPolygonF seen;
  seen << QPointF(0, 0);
  for (const auto& measure : scan_) {
    const double length = std::min<double>(measure.dist, range_) * scale;
    seen << QPointF(-length * std::sin(measure.angle), -length * std::cos(measure.angle));
  }
  painter.setPen(QColor(90, 200, 120));
  painter.setBrush(QColor(40, 110, 70));
  painter.drawPolygon(seen);
  painter.setPen(Qt::NoPen);
  painter.setBrush(QColor(240, 240, 240));
  painter.drawEllipse(QPointF(0, 0), 6, 6);
}
