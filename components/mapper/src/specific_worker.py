"""Sends the points of a lidar to ROS 2. The connection has converted them."""

from __future__ import annotations

import numpy as np

from mapper import Context, Header, PointCloud2, PointField, Scan, Time, Worker

FLOAT32 = 7
NAMES = ("x", "y", "z", "intensity")
STEP = 4 * len(NAMES)


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def lidar_new_scan(self, ctx: Context, scan: Scan) -> None:
        points = [(point.x, point.y, point.z, point.intensity) for point in scan.points]
        data = np.array(points, dtype="<f4").reshape(-1, len(NAMES))
        seconds, rest = divmod(ctx.now_ns(), 1_000_000_000)
        ctx.cloud.new_cloud(
            PointCloud2(
                header=Header(Time(seconds, rest), "lidar"),
                height=1,
                width=len(data),
                fields=[PointField(name, 4 * at, FLOAT32, 1) for at, name in enumerate(NAMES)],
                is_bigendian=False,
                point_step=STEP,
                row_step=STEP * len(data),
                data=np.frombuffer(data.tobytes(), np.uint8),
                is_dense=bool(np.isfinite(data).all()),
            )
        )
