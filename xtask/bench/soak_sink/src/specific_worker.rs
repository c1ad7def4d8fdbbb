//! Checks the number and the content of received values, and replies to queries.

use bench_protocol::soak::{
    STALL, STALL_AT, Sequence, WARM_UP_IMAGES, WARM_UP_TICKS, image, pattern, print,
};
use soak_sink_generated::tracing::warn;
use soak_sink_generated::{Context, Echo, ImageInPlace, Images, Ticks, Worker, WorkerError};

pub struct SpecificWorker {
    pattern: Vec<u8>,
    ticks: Sequence,
    images: Sequence,
    spoilt: u64,
    answered: u64,
    stalled: bool,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            pattern: pattern(),
            ticks: Sequence::default(),
            images: Sequence::default(),
            spoilt: 0,
            answered: 0,
            stalled: false,
        })
    }

    fn compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        self.print_counts()
    }

    fn finalize(&mut self, _ctx: &mut Context) {
        if let Err(error) = self.print_counts() {
            warn!("standard output is closed: {error}");
        }
    }
}

impl SpecificWorker {
    fn print_counts(&self) -> Result<(), WorkerError> {
        let Self { ticks, images, .. } = self;
        let printed = print(&[
            ("ticks", ticks.came),
            ("ticks_lost", ticks.lost),
            ("ticks_next", ticks.next()),
            ("images", images.came),
            ("images_lost", images.lost),
            ("images_next", images.next()),
            ("disordered", ticks.disordered + images.disordered),
            ("spoilt", self.spoilt),
            ("answered", self.answered),
        ]);
        printed.map_err(|error| WorkerError::Fatal(format!("standard output is closed: {error}")))
    }
}

impl Echo<Context> for SpecificWorker {
    fn echo(&mut self, _ctx: &mut Context, data: Vec<u8>) -> Vec<u8> {
        self.answered += 1;
        data
    }
}

impl Ticks<Context> for SpecificWorker {
    fn tick(&mut self, _ctx: &mut Context, number: i64, _data: Vec<u8>) {
        self.ticks.note(number.unsigned_abs(), WARM_UP_TICKS);
        if !self.stalled && number.unsigned_abs() >= STALL_AT {
            self.stalled = true;
            std::thread::sleep(STALL);
        }
    }
}

impl Images<Context> for SpecificWorker {
    fn image(&mut self, _ctx: &mut Context, picture: &ImageInPlace) {
        let number = picture.number.unsigned_abs();
        self.images.note(number, WARM_UP_IMAGES);
        if picture.data() != image(&self.pattern, number) {
            self.spoilt += 1;
        }
    }
}
