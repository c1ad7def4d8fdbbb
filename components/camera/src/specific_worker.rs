//! Publishes a pattern that moves by one pixel with each picture, so that a subscriber can check a
//! picture: the pixel at column x and row y of the picture n is x + y + n, as a byte.

use camera_generated::{
    Camera, CloudInPlace, Context, ImageInPlace, PixelFormat, Worker, WorkerError,
};
use std::time::Instant;

/// The pictures and points published so far.
pub struct SpecificWorker {
    number: i64,
    begun: Instant,
    width: i32,
    height: i32,
}

impl Worker for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            number: 0,
            begun: Instant::now(),
            width: ctx.params.width,
            height: ctx.params.height,
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.number += 1;
        let mut image = ctx.camera_pub.loan_new_image()?;
        self.draw(&mut image)?;
        image.send()?;
        let points = ctx.params.points;
        let mut cloud = ctx.camera_pub.loan_new_cloud()?;
        self.scatter(&mut cloud, points)?;
        cloud.send()?;
        Ok(())
    }
}

impl SpecificWorker {
    fn now(&self) -> i64 {
        i64::try_from(self.begun.elapsed().as_nanos()).unwrap_or(i64::MAX)
    }

    /// Writes the picture of this moment.
    fn draw(&self, image: &mut ImageInPlace) -> Result<(), WorkerError> {
        image.captured = self.now();
        image.number = self.number;
        image.width = self.width;
        image.height = self.height;
        image.format.put(PixelFormat::Grey);
        image.set_frame("camera")?;
        let (width, height) = (self.width.unsigned_abs(), self.height.unsigned_abs());
        let data = image.resize_data(width as usize * height as usize)?;
        for (row, line) in data.chunks_exact_mut(width as usize).enumerate() {
            let first = (self.number as u8).wrapping_add(row as u8);
            for (column, pixel) in line.iter_mut().enumerate() {
                *pixel = first.wrapping_add(column as u8);
            }
        }
        Ok(())
    }

    /// Writes a wall with waves, as many points of it as are wanted.
    fn scatter(&self, cloud: &mut CloudInPlace, points: i32) -> Result<(), WorkerError> {
        const ROW: usize = 100;
        cloud.captured = self.now();
        cloud.number = self.number;
        let points = cloud.resize_points(points.unsigned_abs() as usize)?;
        for (at, point) in points.iter_mut().enumerate() {
            point.x = (at % ROW) as f32 * 10.0 - 500.0;
            point.y = (at / ROW) as f32 * 10.0 - 500.0;
            point.z = 2000.0 + 50.0 * ((point.x + self.number as f32) / 100.0).sin();
        }
        Ok(())
    }
}

impl Camera for SpecificWorker {
    fn get_image(&mut self, _ctx: &mut Context, result: &mut ImageInPlace) {
        if let Err(why) = self.draw(result) {
            camera_generated::tracing::error!("the picture cannot be drawn: {why}");
        }
    }
}
