//! Publishes and sends queries on a schedule. It catches up after a delay, a little in each turn, so
//! that the rates hold on a busy machine.

use bench_protocol::now;
use bench_protocol::soak::{
    HALF, TICK, TICK_BYTES, TICKS_A_QUERY, TICKS_A_SECOND, WARM_UP_TICKS, WITHOUT_IMAGES, image,
    is_image_due, pattern, print,
};
use soak_source_generated::tracing::warn;
use soak_source_generated::{CallError, Context, Image, Worker, WorkerError};

/// The most ticks of one turn, below the depth of the subscriber (100).
const MOST_TICKS: u64 = 10;
/// The longest delay. Beyond it the schedule begins again, and the missed ticks are skipped.
const MOST_BEHIND: u64 = TICKS_A_SECOND;

pub struct SpecificWorker {
    pattern: Vec<u8>,
    picture: Image,
    sends_images: bool,
    /// 2 at half the rates, else 1.
    slower: u64,
    begin: i64,
    /// The next tick of the schedule; `ticks` of them were sent.
    next: u64,
    ticks: u64,
    images: u64,
    asked: u64,
    answered: u64,
    wrong: u64,
    failed: u64,
    skipped: u64,
    printed: u64,
}

impl Worker<Context> for SpecificWorker {
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
            printed: 0,
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
        if seconds > self.printed {
            self.printed = seconds;
            self.print_counts()?;
        }
        Ok(())
    }

    fn finalize(&mut self, _ctx: &mut Context) {
        if let Err(error) = self.print_counts() {
            warn!("standard output is closed: {error}");
        }
    }
}

impl SpecificWorker {
    fn turn(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        ctx.ticks
            .tick(self.ticks as i64, &self.pattern[..TICK_BYTES])?;
        self.ticks += 1;
        if self.sends_images && is_image_due(self.ticks) {
            self.publish_image(ctx)?;
        }
        if self.ticks > WARM_UP_TICKS && self.ticks.is_multiple_of(TICKS_A_QUERY * self.slower) {
            self.query(ctx);
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

    fn query(&mut self, ctx: &mut Context) {
        let question = self.asked.to_le_bytes();
        self.asked += 1;
        match ctx.echo.echo(&question) {
            Ok(answer) if answer == question => self.answered += 1,
            Ok(_) => self.wrong += 1,
            // A query that the end of the component interrupts is not counted.
            Err(CallError::Stopping) => self.asked -= 1,
            Err(error) => {
                self.failed += 1;
                warn!("a question had no answer: {error}");
            }
        }
    }

    fn print_counts(&self) -> Result<(), WorkerError> {
        let printed = print(&[
            ("ticks", self.ticks),
            ("images", self.images),
            ("asked", self.asked),
            ("answered", self.answered),
            ("wrong", self.wrong),
            ("failed", self.failed),
            ("skipped", self.skipped),
        ]);
        printed.map_err(|error| WorkerError::Fatal(format!("standard output is closed: {error}")))
    }
}
