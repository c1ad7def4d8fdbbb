//! Publishes received samples again, answers calls, and calls the oracle on request.

use interop_generated::tracing::warn;
use interop_generated::{
    AskError, Broken, CallError, Camera, CameraInfo, Context, Everything, FailError, Gone, Header,
    Image, Interop, Mirror, Nonsense, Orders, ParamChange, Report, Reports, ShiftError, Talk,
    Worker, WorkerError,
};
use std::time::Duration;

/// Longest call of the camera driver.
const DRIVER: Duration = Duration::from_secs(20);

pub struct SpecificWorker {
    noted: Vec<String>,
    /// The number of the next image.
    image: i32,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            noted: Vec::new(),
            image: 0,
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let images = &ctx.params.images;
        if self.image < images.count {
            let image = image(self.image, images.bytes.unsigned_abs());
            self.image += 1;
            if let Err(error) = ctx.images.image(&image) {
                warn!("image {} is not published: {error}", image.header.frame_id);
            }
        }
        Ok(())
    }

    fn params_changed(
        &mut self,
        _ctx: &mut Context,
        changes: &[ParamChange],
    ) -> Result<(), WorkerError> {
        if changes.iter().any(|change| change.path == "images.count") {
            self.image = 0;
        }
        Ok(())
    }
}

/// An image of one line. All its bytes are the number of its frame, modulo 251.
fn image(number: i32, bytes: u32) -> Image {
    Image {
        header: Header {
            frame_id: number.to_string(),
            ..Header::default()
        },
        height: 1,
        width: bytes,
        encoding: "mono8".to_owned(),
        is_bigendian: 0,
        step: bytes,
        data: vec![(number % 251) as u8; bytes as usize],
    }
}

impl Camera<Context> for SpecificWorker {
    fn set_camera_info(&mut self, ctx: &mut Context, camera_info: CameraInfo) -> (bool, String) {
        if camera_info.header.frame_id != "forward" {
            return (true, camera_info.distortion_model);
        }
        ctx.camera_driver.set_timeout(DRIVER);
        let reply = ctx.camera_driver.set_camera_info(&camera_info);
        reply.unwrap_or_else(|error| (false, error.to_string()))
    }
}

impl Interop<Context> for SpecificWorker {
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

impl Mirror<Context> for SpecificWorker {
    fn echo(&mut self, _ctx: &mut Context, all: Everything) -> Everything {
        all
    }

    fn fail(&mut self, _ctx: &mut Context, which: i32) -> Result<(), FailError> {
        let code = which;
        let what = "asked to".to_owned();
        Err(match which {
            0 => return Ok(()),
            1 => Gone {}.into(),
            _ => Broken { what, code }.into(),
        })
    }
}

impl Reports<Context> for SpecificWorker {
    fn report(&mut self, ctx: &mut Context, report: Report) {
        if let Err(error) = ctx.echoes.echo(&report) {
            warn!("report {} is not published again: {error}", report.number);
        }
    }
}

impl Talk<Context> for SpecificWorker {
    fn chatter(&mut self, ctx: &mut Context, data: String) {
        if let Err(error) = ctx.gossip.chatter(&data) {
            warn!("`{data}` is not published again: {error}");
        }
    }
}

impl Orders<Context> for SpecificWorker {
    fn order(&mut self, _ctx: &mut Context, text: String) {
        self.noted.push(text);
    }
}
