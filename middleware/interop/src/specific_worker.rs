//! Publishes received samples again, answers calls, and calls the oracle on request.

use interop_generated::tracing::warn;
use interop_generated::{
    AskError, CallError, Context, Interop, Nonsense, Orders, Report, Reports, ShiftError, Talk,
    Worker, WorkerError,
};
use std::time::Duration;

pub struct SpecificWorker {
    noted: Vec<String>,
}

impl Worker for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self { noted: Vec::new() })
    }

    fn compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        Ok(())
    }
}

impl Interop for SpecificWorker {
    fn shift(
        &mut self,
        _ctx: &mut Context,
        mut report: Report,
        by: f64,
    ) -> Result<(Report, i32), ShiftError> {
        if report.marks.is_empty() {
            let what = format!("`{}` has no marks", report.text);
            return Err(Nonsense { what, code: -7 }.into());
        }
        for mark in &mut report.marks {
            mark.at.x += by as f32;
            mark.at.y += by;
        }
        let count = report.marks.len() as i32;
        Ok((report, count))
    }

    fn note(&mut self, ctx: &mut Context, text: String) {
        if let Err(error) = ctx.archive.keep(&text) {
            warn!("`{text}` is not archived: {error}");
        }
        self.noted.push(text);
    }

    fn noted(&mut self, _ctx: &mut Context) -> Vec<String> {
        self.noted.clone()
    }

    fn consult(&mut self, ctx: &mut Context, question: String, limit: i32) -> String {
        let limit = Duration::from_millis(limit.unsigned_abs().into());
        ctx.oracle.set_timeout(limit);
        let answer = ctx.oracle.ask(&question);
        match answer {
            Ok((number, place)) => {
                // A command, after the query.
                match ctx.oracle.tell(&question) {
                    Ok(()) => format!("{number} at {} {}", place.x, place.y),
                    Err(error) => format!("not told: {error}"),
                }
            }
            Err(AskError::Nonsense(Nonsense { what, code })) => format!("nonsense {code}: {what}"),
            Err(AskError::Call(CallError::Refused(reason))) => format!("refused: {reason}"),
            Err(AskError::Call(CallError::ServerDied(_))) => "the server died".to_owned(),
            Err(AskError::Call(error)) => error.to_string(),
        }
    }

    fn add(&mut self, _ctx: &mut Context, a: i64, b: i64) -> i64 {
        a.wrapping_add(b)
    }
}

impl Reports for SpecificWorker {
    fn report(&mut self, ctx: &mut Context, report: Report) {
        if let Err(error) = ctx.echoes.echo(&report) {
            warn!("report {} is not published again: {error}", report.number);
        }
    }
}

impl Talk for SpecificWorker {
    fn chatter(&mut self, ctx: &mut Context, data: String) {
        if let Err(error) = ctx.gossip.chatter(&data) {
            warn!("`{data}` is not published again: {error}");
        }
    }
}

impl Orders for SpecificWorker {
    fn order(&mut self, _ctx: &mut Context, text: String) {
        self.noted.push(text);
    }
}
