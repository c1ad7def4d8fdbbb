//! Replies to queries, records the latencies of values, and reports them at the end of a block.

use bench_protocol::{now, ready, report};
use pong_generated::tracing::error;
use pong_generated::{
    Awake, AwakeSlot, Clouds, Context, Echo, ParamChange, PictureInPlace, Pictures, Point, Sample,
    Worker, WorkerError,
};

pub struct SpecificWorker {
    times: Vec<i64>,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        ready()?;
        Ok(Self { times: Vec::new() })
    }

    fn compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        Ok(())
    }

    fn params_changed(
        &mut self,
        ctx: &mut Context,
        _changes: &[ParamChange],
    ) -> Result<(), WorkerError> {
        if ctx.params.sent != 0 {
            self.times.push(now() - ctx.params.sent);
            return Ok(());
        }
        report(&self.times)?;
        self.times.clear();
        Ok(())
    }
}

impl Echo<Context> for SpecificWorker {
    fn echo(&mut self, _ctx: &mut Context, data: Vec<u8>) -> Vec<u8> {
        data
    }
}

impl Awake<Context, AwakeSlot> for SpecificWorker {
    fn echo(&mut self, _ctx: &mut Context, data: Vec<u8>) -> Vec<u8> {
        data
    }
}

impl Sample<Context> for SpecificWorker {
    fn sample(&mut self, ctx: &mut Context, sent: i64, data: Vec<u8>) {
        if ctx.params.relays {
            if let Err(error) = ctx.onward.sample(sent, &data) {
                error!("a value is not passed on: {error}");
            }
            return;
        }
        if !data.is_empty() {
            self.times.push(now() - sent);
            return;
        }
        if let Err(error) = report(&self.times) {
            error!("standard output is closed: {error}");
        }
        self.times.clear();
    }
}

impl Clouds<Context> for SpecificWorker {
    fn cloud(&mut self, _ctx: &mut Context, sent: i64, points: Vec<Point>) {
        if !points.is_empty() {
            self.times.push(now() - sent);
        }
    }
}

impl Pictures<Context> for SpecificWorker {
    fn picture(&mut self, _ctx: &mut Context, picture: &PictureInPlace) {
        self.times.push(now() - picture.sent);
    }
}
