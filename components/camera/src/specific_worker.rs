//! Publishes a pattern that moves by one pixel with each picture, so that a subscriber can check a
//! picture: the pixel at column x and row y of the picture n is x + y + n, as a byte.
//!
//! With discs, it publishes pictures in colour: discs on grey, which go round.

use camera_generated::{
    Camera, CloudInPlace, Context, ImageInPlace, PixelFormat, Worker, WorkerError,
};
use std::time::Instant;

/// The colours of the discs: red, green, blue, yellow.
const COLOURS: [[u8; 3]; 4] = [[220, 40, 40], [40, 180, 60], [40, 70, 220], [230, 210, 40]];
const GREY: u8 = 128;
/// How many pictures a disc takes to go round.
const ROUND: f32 = 300.0;

/// The pictures and points published so far.
pub struct SpecificWorker {
    number: i64,
    begun: Instant,
    width: i32,
    height: i32,
    discs: u16,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            number: 0,
            begun: Instant::now(),
            width: ctx.params.width,
            height: ctx.params.height,
            discs: u16::try_from(ctx.params.discs).unwrap_or_default(),
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
        image.set_frame("camera")?;
        let (width, height) = (self.width.unsigned_abs(), self.height.unsigned_abs());
        if self.discs > 0 {
            image.format.put(PixelFormat::Rgb);
            let data = image.resize_data(width as usize * height as usize * 3)?;
            self.colour(data, width as usize, height as usize);
            return Ok(());
        }
        image.format.put(PixelFormat::Grey);
        let data = image.resize_data(width as usize * height as usize)?;
        for (row, line) in data.chunks_exact_mut(width as usize).enumerate() {
            let first = (self.number as u8).wrapping_add(row as u8);
            for (column, pixel) in line.iter_mut().enumerate() {
                *pixel = first.wrapping_add(column as u8);
            }
        }
        Ok(())
    }

    /// Writes the discs. Their centres go round on an ellipse of half the picture's size; a radius is
    /// a tenth of its shorter side.
    fn colour(&self, data: &mut [u8], width: usize, height: usize) {
        data.fill(GREY);
        let radius = width.min(height) as f32 / 10.0;
        for (disc, colour) in (0..self.discs).zip(COLOURS) {
            let turns = self.number as f32 / ROUND + f32::from(disc) / f32::from(self.discs);
            let (sin, cos) = (turns * std::f32::consts::TAU).sin_cos();
            let x = width as f32 * (0.5 + 0.25 * cos);
            let y = height as f32 * (0.5 + 0.25 * sin);
            for (row, line) in data.chunks_exact_mut(width * 3).enumerate() {
                let half = radius.powi(2) - (row as f32 + 0.5 - y).powi(2);
                if half > 0.0 {
                    let half = half.sqrt();
                    let (first, last) = ((x - half).round(), (x + half).round());
                    let (first, last) = (first.max(0.0) as usize, last.max(0.0) as usize);
                    let line = &mut line[3 * first.min(width)..3 * last.min(width)];
                    line.as_chunks_mut().0.fill(colour);
                }
            }
        }
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

impl Camera<Context> for SpecificWorker {
    fn get_image(&mut self, _ctx: &mut Context, result: &mut ImageInPlace) {
        if let Err(why) = self.draw(result) {
            camera_generated::tracing::error!("the picture cannot be drawn: {why}");
        }
    }
}
