//! Sends and asks on a schedule. What is late is caught up with, a little in each turn, so that the
//! rates hold on a machine that is busy with other things.

use bench_protocol::now;
use bench_protocol::soak::{
    HALF, TICK, TICKS_A_QUERY, TICKS_A_SECOND, WARM_UP_TICKS, WITHOUT_IMAGES, image, is_image_due,
    pattern, tell,
};
use soak_source_generated::tracing::warn;
use soak_source_generated::{CallError, Context, Image, Worker, WorkerError};

/// Ticks of one turn: a reliable subscriber of depth 100 is never surprised by more.
const MOST_TICKS: u64 = 10;
/// Further behind than this, the schedule begins anew: what was missed is not sent.
const MOST_BEHIND: u64 = TICKS_A_SECOND;

pub struct SpecificWorker {
    pattern: Vec<u8>,
    picture: Image,
    sends_images: bool,
    /// 2 where it does less of everything, else 1.
    slower: u64,
    begin: i64,
    /// The tick of the schedule that comes next; `ticks` of them were sent.
    next: u64,
    ticks: u64,
    images: u64,
    asked: u64,
    answered: u64,
    wrong: u64,
    failed: u64,
    skipped: u64,
    told: u64,
}

impl Worker for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            pattern: pattern(),
            picture: Image {
                width: 1000,
                height: 1000,
                ..Image::default()
            },
            sends_images: std::env::var_os(WITHOUT_IMAGES).is_none(),
            slower: if std::env::var_os(HALF).is_some() {
                2
            } else {
                1
            },
            begin: now(),
            next: 0,
            ticks: 0,
            images: 0,
            asked: 0,
            answered: 0,
            wrong: 0,
            failed: 0,
            skipped: 0,
            told: 0,
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let tick = TICK.as_nanos() as u64 * self.slower;
        let due = (now() - self.begin).unsigned_abs() / tick;
        if due > self.next + MOST_BEHIND {
            self.skipped += due - self.next;
            self.next = due;
        }
        for _ in 0..due.saturating_sub(self.next).min(MOST_TICKS) {
            if ctx.is_stopping() {
                return Ok(());
            }
            self.next += 1;
            self.turn(ctx)?;
        }
        let seconds = self.next * self.slower / TICKS_A_SECOND;
        if seconds > self.told {
            self.told = seconds;
            self.tell()?;
        }
        Ok(())
    }

    fn finalize(&mut self, _ctx: &mut Context) {
        if let Err(error) = self.tell() {
            warn!("nobody listens: {error}");
        }
    }
}

impl SpecificWorker {
    fn turn(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        ctx.ticks.tick(self.ticks as i64)?;
        self.ticks += 1;
        if self.sends_images && is_image_due(self.ticks) {
            self.publish_image(ctx)?;
        }
        if self.ticks > WARM_UP_TICKS && self.ticks.is_multiple_of(TICKS_A_QUERY * self.slower) {
            self.ask(ctx);
        }
        Ok(())
    }

    /// Publishes every other image in place.
    fn publish_image(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let data = image(&self.pattern, self.images);
        if self.images.is_multiple_of(2) {
            let mut picture = ctx.images.loan_image()?;
            picture.number = self.images as i64;
            (picture.width, picture.height) = (self.picture.width, self.picture.height);
            picture.resize_data(data.len())?.copy_from_slice(data);
            picture.send()?;
        } else {
            self.picture.number = self.images as i64;
            self.picture.data.clear();
            self.picture.data.extend_from_slice(data);
            ctx.images.image(&self.picture)?;
        }
        self.images += 1;
        Ok(())
    }

    fn ask(&mut self, ctx: &mut Context) {
        let question = self.asked.to_le_bytes();
        self.asked += 1;
        match ctx.echo.echo(&question) {
            Ok(answer) if answer == question => self.answered += 1,
            Ok(_) => self.wrong += 1,
            // The question that a stop cuts short was not asked.
            Err(CallError::Stopping) => self.asked -= 1,
            Err(error) => {
                self.failed += 1;
                warn!("a question had no answer: {error}");
            }
        }
    }

    fn tell(&self) -> Result<(), WorkerError> {
        let told = tell(&[
            ("ticks", self.ticks),
            ("images", self.images),
            ("asked", self.asked),
            ("answered", self.answered),
            ("wrong", self.wrong),
            ("failed", self.failed),
            ("skipped", self.skipped),
        ]);
        told.map_err(|error| WorkerError::Fatal(format!("nobody listens: {error}")))
    }
}
