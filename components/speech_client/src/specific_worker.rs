//! Has its sentences said, and waits for each to end.

use crate::dialogue::{Dialogue, Next};
use speech_client_generated::tracing::{info, warn};
use speech_client_generated::{
    Context, DataenableSynchronizationin, Datasayin, Worker, WorkerError,
};

/// The state of the conversation.
pub struct SpecificWorker {
    dialogue: Dialogue,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let dialogue = Dialogue::new(ctx.params.sentences.len(), ctx.params.repeat);
        Ok(Self { dialogue })
    }

    /// Does one thing; what fails is tried again in the next period.
    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        match self.dialogue.next() {
            Next::Synchronize => {
                let request = DataenableSynchronizationin {
                    enable: ctx.params.synchronized,
                };
                ctx.speech.enable_synchronization(&request)?;
                self.dialogue.synchronized();
            }
            Next::Say(index) => self.say(ctx, index)?,
            Next::Listen => {
                if !ctx.speech.is_busy()?.result {
                    self.dialogue.finished();
                }
            }
            Next::End => ctx.stop("everything has been said"),
        }
        Ok(())
    }
}

impl SpecificWorker {
    fn say(&mut self, ctx: &mut Context, index: usize) -> Result<(), WorkerError> {
        let text = ctx.params.sentences.get(index).cloned().unwrap_or_default();
        let request = Datasayin {
            text,
            overwrite: false,
        };
        let response = ctx.speech.say(&request)?;
        if response.result {
            info!("asked to say: {}", request.text);
            self.dialogue.accepted();
        } else {
            warn!("refused: {}", response.reason);
        }
        Ok(())
    }
}
