//! `cargo xtask soak`: two generated components exchange messages for an hour. Nothing may grow,
//! and no sample may be lost.
//!
//! `soak_source` publishes ticks (1 kHz) and images of about 1 MB (30 Hz), and sends queries (200
//! Hz) to `soak_sink`. Over DDS and ROS 2 there are no images, and over ROS 2 half of the ticks and
//! a quarter of the queries. Counting starts after a warm-up in which every queue overflows once,
//! so that all memory is in use. `judge` has the requirements.

mod judge;

use crate::figure::BUILD;
use crate::pair::Network;
use crate::programs::{Failure, Program, cargo, finish, target};
use crate::usage::{descriptors, made_memory, processor_time, shared_memory};
use crate::variant::{self, DDS, ROS2};
use bench_protocol::soak::{Counts, HALF, TICKS_A_SECOND, WARM_UP_TICKS, WITHOUT_IMAGES};
use judge::{Sample, complaint, grown, lost, row, shares};
use rc_cdsl::model::Middleware;
use rc_deploy_network::Profile;
use rc_management::{Client, component};
use serde_json::Value;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The limit until a component prints its first or next counts.
const COUNTS: Duration = Duration::from_secs(20);
/// The limit for the end of a component.
const END: Duration = Duration::from_secs(5);
/// The limit for a reply of management.
const ANSWER: Duration = Duration::from_secs(2);
/// The pause between two polls for a signal.
const LOOK: Duration = Duration::from_millis(50);
/// The pause between two measurements of the memory.
const SAMPLE: Duration = Duration::from_secs(1);

/// The parameters of a run.
struct Plan {
    /// The duration after the warm-up.
    length: Duration,
    /// The programs of sink and source.
    programs: [PathBuf; 2],
    /// The middleware of both.
    middleware: SoakMiddleware,
    /// The pause between two printed lines.
    line: Duration,
}

/// The middleware of a run.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum SoakMiddleware {
    /// The one of the committed generated code.
    Iceoryx2,
    /// The components as variants for DDS.
    Dds,
    Ros2,
}

impl SoakMiddleware {
    fn settings(self) -> &'static [&'static str] {
        match self {
            Self::Iceoryx2 => &[],
            Self::Dds => &DDS,
            Self::Ros2 => &ROS2,
        }
    }

    /// Further arguments of the source.
    fn variables(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Iceoryx2 => &[],
            // Images of a megabyte leave gaps in the heap of the library. They look like a leak and
            // are none.
            Self::Dds => &[(WITHOUT_IMAGES, "1")],
            // Half the rate, with which the limits of BENCHMARKS.md were measured.
            Self::Ros2 => &[(WITHOUT_IMAGES, "1"), (HALF, "1")],
        }
    }

    /// The programs of sink and source in the folder of `profile`.
    fn programs(self, profile: Profile) -> Result<[PathBuf; 2], Failure> {
        match self {
            Self::Iceoryx2 => {
                let folder = target()?.join(profile.folder());
                Ok(["soak_sink", "soak_source"].map(|name| folder.join(name)))
            }
            // Tests do not build: that would take the processors from other tests.
            Self::Dds if profile == Profile::Dev => {
                variant::built("soak", Middleware::Dds, profile)
            }
            Self::Ros2 if profile == Profile::Dev => {
                variant::built("soak", Middleware::Ros2, profile)
            }
            Self::Dds => variant::build("soak", Middleware::Dds, profile),
            Self::Ros2 => variant::build("soak", Middleware::Ros2, profile),
        }
    }
}

/// Builds the components and runs the soak for `seconds`.
pub(crate) fn run(middleware: SoakMiddleware, seconds: &str) -> Result<(), Failure> {
    if middleware == SoakMiddleware::Iceoryx2 {
        let words = "build --release -p soak_source -p soak_sink";
        finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    }
    soak(&Plan {
        length: Duration::from_secs(seconds.parse()?),
        programs: middleware.programs(Profile::Release)?,
        middleware,
        line: Duration::from_mins(1),
    })
}

/// The short soak of the test run, with the components that the test run has built.
pub(crate) fn smoke(middleware: SoakMiddleware) -> Result<(), Failure> {
    soak(&Plan {
        length: Duration::from_secs(20),
        programs: middleware.programs(Profile::Dev)?,
        middleware,
        line: Duration::from_secs(5),
    })
}

/// Runs the soak until its end or a signal. An error lists each requirement that was not met.
fn soak(plan: &Plan) -> Result<(), Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let mut soak = Soak::start(plan)?;
    println!(
        "network {}, soak_source {}, soak_sink {}",
        soak.network.name,
        soak.source.pid(),
        soak.sink.pid()
    );
    if soak.warm_up(&stop)? {
        soak.watch(plan, &stop)?;
    }
    let verdict = soak.end()?;
    println!("{}", verdict.line);
    if verdict.complaints.is_empty() {
        return Ok(());
    }
    Err(verdict.complaints.join("; ").into())
}

/// The result of a run: a row of a table, and the requirements that were not met.
struct Verdict {
    line: String,
    complaints: Vec<String>,
}

/// A running soak. Dropping it ends the source first, the network last.
struct Soak {
    source: Program,
    sink: Program,
    sent: Counts,
    came: Counts,
    samples: Vec<Sample>,
    network: Network,
}

impl Soak {
    fn start(plan: &Plan) -> Result<Self, Failure> {
        let network = Network::new("soak")?;
        let arguments = |log| {
            let own = ["--network", network.name.as_str(), "--log", log];
            [&own, plan.middleware.settings()].concat()
        };
        let [sink, source] = &plan.programs;
        let sink = Program::start_apart(sink, &arguments("warn"))?;
        // The sink starts first: a subscriber that is there before the publisher loses nothing.
        let came = counts(&sink.read_line(COUNTS)?)?;
        // Its computes are sometimes longer than a period, because it catches up; that is not a
        // warning.
        let mut command = Command::new(source);
        command.args(arguments("error")).process_group(0);
        command.envs(plan.middleware.variables().iter().copied());
        let source = Program::spawn(command)?;
        let sent = counts(&source.read_line(COUNTS)?)?;
        Ok(Self {
            source,
            sink,
            sent,
            came,
            samples: Vec::new(),
            network,
        })
    }

    /// Waits until the counting begins; `false` if a signal came first.
    fn warm_up(&mut self, stop: &AtomicBool) -> Result<bool, Failure> {
        let end = Instant::now() + 3 * COUNTS;
        while self.came.get("ticks_next") < WARM_UP_TICKS + TICKS_A_SECOND {
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            if Instant::now() > end {
                return Err("the components do not get warm: too few ticks arrive".into());
            }
            std::thread::sleep(LOOK);
            self.read_counts()?;
        }
        Ok(true)
    }

    /// Samples and prints until the time is over or a signal comes.
    fn watch(&mut self, plan: &Plan, stop: &AtomicBool) -> Result<(), Failure> {
        let start = Instant::now();
        let end = start + plan.length;
        let (mut sample, mut line) = (start, start + plan.line);
        let mut silent_from = (Instant::now(), 0);
        while Instant::now() < end && !stop.load(Ordering::Relaxed) {
            self.read_counts()?;
            let arrived = self.came.get("ticks") + self.sent.get("ticks");
            if arrived != silent_from.1 {
                silent_from = (Instant::now(), arrived);
            } else if silent_from.0.elapsed() > COUNTS {
                return Err(format!("no tick arrived within {COUNTS:?}").into());
            }
            if Instant::now() >= sample {
                sample += SAMPLE;
                self.sample()?;
            }
            if Instant::now() >= line {
                println!("{:>6} s  {}", (line - start).as_secs(), self.progress());
                line += plan.line;
            }
            std::thread::sleep(LOOK);
        }
        Ok(())
    }

    /// Handles the lines that the components have printed.
    fn read_counts(&mut self) -> Result<(), Failure> {
        let lines = self.source.read_lines()?;
        if let Some(line) = lines.last() {
            self.sent = counts(line)?;
        }
        let lines = self.sink.read_lines()?;
        if let Some(line) = lines.last() {
            self.came = counts(line)?;
        }
        Ok(())
    }

    fn sample(&mut self) -> Result<(), Failure> {
        let (source, sink) = (self.source.pid(), self.sink.pid());
        self.samples.push(Sample {
            at: Instant::now(),
            memory: [
                made_memory(source)?,
                made_memory(sink)?,
                shared_memory(&self.network.directory),
            ],
            descriptors: descriptors(source)? + descriptors(sink)?,
            processor: [processor_time(source)?, processor_time(sink)?],
        });
        Ok(())
    }

    /// A line on the present state.
    fn progress(&self) -> String {
        let Self { sent, came, .. } = self;
        let [source, sink, shared] = self.samples.last().map_or([0.0; 3], |s| s.memory);
        let processor = shares(&self.samples);
        format!(
            "ticks {} lost {}, images {} lost {}, answers {} of {}, PSS {source:.2} + {sink:.2} MB, shared {shared:.2} MB, processor {:.1} + {:.1} %",
            came.get("ticks"),
            came.get("ticks_lost"),
            came.get("images"),
            came.get("images_lost"),
            sent.get("answered"),
            sent.get("asked"),
            processor[0],
            processor[1],
        )
    }

    /// Stops the source, waits until the sink has everything that was sent, stops the sink, and
    /// judges.
    fn end(mut self) -> Result<Verdict, Failure> {
        let mut complaints = Vec::new();
        complaints.extend(complaint(
            "soak_source",
            &status(&self.network, "soak_source")?,
        ));
        let lines = self.source.end(END)?;
        if let Some(line) = lines.last() {
            self.sent = counts(line)?;
        }
        let sent = &self.sent;
        // Counts printed before the source's end are too old, and the first ones afterwards may be,
        // too.
        self.sink.read_lines()?;
        for _ in 0..2 {
            self.came = counts(&self.sink.read_line(COUNTS)?)?;
        }
        complaints.extend(complaint("soak_sink", &status(&self.network, "soak_sink")?));
        self.sink.end(END)?;
        let network = self.network;
        let name = network.name.clone();
        let directory = network.directory.clone();
        drop(network);
        if !rc_iceoryx2::leftovers(&directory).is_empty() || directory.path().exists() {
            complaints.push(format!("something of the network {name} is left"));
        }
        complaints.extend(lost(sent, &self.came));
        complaints.extend(grown(&self.samples));
        Ok(Verdict {
            line: row(sent, &self.came, &self.samples, complaints.is_empty()),
            complaints,
        })
    }
}

fn counts(line: &str) -> Result<Counts, Failure> {
    Counts::read(line).ok_or_else(|| format!("`{line}` instead of counts").into())
}

/// The status of a component.
fn status(network: &Network, name: &str) -> Result<Value, Failure> {
    let mut client = Client::connect(&network.directory.socket(name), ANSWER)?;
    Ok(client.call(&component::Request::Status, ANSWER)?)
}
