//! Follows the poses that are published and shows them.

use crate::track::Track;
use crate::{chart, screen};
use planar_map::{Map, Pose};
use pose_monitor_generated::tracing::{error, info};
use pose_monitor_generated::{Context, FullPoseEstimationPub, FullPoseEuler, Worker, WorkerError};
use std::fs::File;
use std::io::{BufWriter, IsTerminal, Write};
use std::path::Path;

/// Moves the cursor of a terminal to the upper left corner and clears the screen.
const CLEAR: &str = "\x1b[H\x1b[J";

/// The map, the path so far, and the outputs.
pub struct SpecificWorker {
    map: Map,
    track: Track,
    trace: Option<BufWriter<File>>,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        let map = Map::load(&ctx.params.map)?;
        let path = &ctx.params.trace;
        let trace = if path.as_os_str().is_empty() {
            None
        } else {
            Some(create(path)?)
        };
        Ok(Self {
            map,
            track: Track::default(),
            trace,
        })
    }

    fn compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        let mut out = std::io::stdout().lock();
        if out.is_terminal() {
            write!(out, "{CLEAR}{}", screen::picture(&self.map, &self.track))?;
        }
        writeln!(out, "{}", self.track.line())?;
        Ok(())
    }

    fn finalize(&mut self, ctx: &mut Context) {
        if let Some(Err(why)) = self.trace.as_mut().map(Write::flush) {
            error!("{}: {why}", ctx.params.trace.display());
        }
        let path = &ctx.params.svg;
        if path.as_os_str().is_empty() {
            return;
        }
        match self.draw(path) {
            Ok(()) => info!(
                "{}: {:.1} m, {} poses",
                path.display(),
                self.track.metres(),
                self.track.count
            ),
            Err(why) => error!("{}: {why}", path.display()),
        }
    }
}

impl SpecificWorker {
    fn draw(&self, path: &Path) -> std::io::Result<()> {
        let page = chart::svg(&self.map, &self.track).map_err(std::io::Error::other)?;
        make_folder_of(path)?;
        std::fs::write(path, page)
    }

    /// Writes one line of the trace, with every digit of its numbers. After an error, the trace
    /// ends.
    fn write_trace(&mut self, pose: &FullPoseEuler) {
        let Some(trace) = &mut self.trace else { return };
        if let Err(why) = writeln!(
            trace,
            "{},{},{},{}",
            self.track.count, pose.x, pose.y, pose.rz
        ) {
            error!("the trace ends at pose {}: {why}", self.track.count);
            self.trace = None;
        }
    }
}

fn make_folder_of(path: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new("")))
}

/// Creates a file and its folder.
fn create(path: &Path) -> Result<BufWriter<File>, WorkerError> {
    let file = make_folder_of(path)
        .and_then(|()| File::create(path))
        .map_err(|why| WorkerError::Fatal(format!("{}: {why}", path.display())))?;
    Ok(BufWriter::new(file))
}

impl FullPoseEstimationPub<Context> for SpecificWorker {
    fn new_full_pose(&mut self, ctx: &mut Context, pose: FullPoseEuler) {
        let wanted = usize::try_from(ctx.params.samples).unwrap_or(0);
        if wanted > 0 && self.track.count >= wanted {
            return;
        }
        self.track.add(Pose::new(
            f64::from(pose.x),
            f64::from(pose.y),
            f64::from(pose.rz),
        ));
        self.write_trace(&pose);
        if self.track.count == wanted {
            ctx.stop("as many poses as were asked for");
        }
    }
}
