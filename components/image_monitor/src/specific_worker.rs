//! Looks at pictures where the camera wrote them.

use image_monitor_generated::tracing::info;
use image_monitor_generated::{
    CameraPub, CloudInPlace, Context, ImageInPlace, Worker, WorkerError,
};

/// Counters since the last printed line.
#[derive(Default)]
pub struct SpecificWorker {
    images: u32,
    points: usize,
    /// The reason why the last damaged picture was damaged.
    broken: Option<String>,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self::default())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let asked = ctx
            .camera
            .get_image_in_place(|image| whole(image).map(|()| image.number))?;
        let number = asked.map_err(WorkerError::Failed)?;
        info!(
            "{} pictures, {} points; asked for picture {number}",
            self.images, self.points
        );
        (self.images, self.points) = (0, 0);
        match self.broken.take() {
            Some(why) => Err(WorkerError::Failed(why)),
            None => Ok(()),
        }
    }
}

impl CameraPub<Context> for SpecificWorker {
    fn new_image(&mut self, _ctx: &mut Context, image: &ImageInPlace) {
        self.images += 1;
        self.broken = whole(image).err().or(self.broken.take());
    }

    fn new_cloud(&mut self, _ctx: &mut Context, cloud: &CloudInPlace) {
        self.points += cloud.points().len();
    }
}

/// Whether each row of a picture begins and ends as the camera says.
fn whole(image: &ImageInPlace) -> Result<(), String> {
    let width = usize::try_from(image.width).unwrap_or(0).max(1);
    let height = usize::try_from(image.height).unwrap_or(0);
    let data = image.data();
    if data.len() != width * height {
        return Err(format!(
            "{} bytes are not {width} x {height} pixels",
            data.len()
        ));
    }
    for (row, line) in data.chunks_exact(width).enumerate() {
        let pixel = |column: usize| (image.number as u8).wrapping_add((row + column) as u8);
        if (line[0], line[width - 1]) != (pixel(0), pixel(width - 1)) {
            return Err(format!(
                "row {row} of picture {} is of another one",
                image.number
            ));
        }
    }
    Ok(())
}
