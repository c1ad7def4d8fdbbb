//! Writes the texts that clients ask it to say into the log.

use crate::voice::Voice;
use speech_server_generated::tracing::info;
use speech_server_generated::{
    Context, DataenableSynchronizationin, Dataresponse, Datasayin, Speech, Worker, WorkerError,
};
use std::time::Instant;

/// The voice, and the time up to which it has spoken.
pub struct SpecificWorker {
    voice: Voice,
    spoken_until: Instant,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            voice: Voice::default(),
            spoken_until: Instant::now(),
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let now = Instant::now();
        let elapsed = now.duration_since(self.spoken_until);
        self.spoken_until = now;
        for text in self.voice.advance(elapsed, ctx.params.per_character) {
            info!("says: {text}");
        }
        Ok(())
    }
}

impl Speech<Context> for SpecificWorker {
    fn say(&mut self, ctx: &mut Context, request: Datasayin) -> Dataresponse {
        if request.overwrite {
            self.voice.silence();
        }
        let limit = usize::try_from(ctx.params.queue).unwrap_or(0);
        let result = self.voice.say(request.text, limit);
        let reason = if result {
            String::new()
        } else {
            format!("{limit} texts are waiting already")
        };
        Dataresponse { result, reason }
    }

    fn is_busy(&mut self, _ctx: &mut Context) -> Dataresponse {
        Dataresponse {
            result: self.voice.is_busy(),
            reason: String::new(),
        }
    }

    fn enable_synchronization(&mut self, _ctx: &mut Context, request: DataenableSynchronizationin) {
        self.voice.synchronized = request.enable;
    }
}
