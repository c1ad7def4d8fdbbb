//! Some twenty components under load. Every second one component is killed, also during its start;
//! every half minute rcdeploy, and sometimes its guard. In some seconds there is other trouble, see
//! `trouble`, and all the time a hostile peer of DDS. The times in the events of rcdeploy are the
//! measure. Seconds in which the network starts do not count, so a run on a slow machine makes as
//! many troubles as one on a quick machine.

use super::ground::{CLOCK, Ground, NETWORK, Text};
use super::hostile::{self, Hostile};
use super::supervised::{Supervisor, kill_one, pid};
use super::trouble::{Consequence, NO_DESCRIPTOR, Troubles};
use super::{Dice, Tally, mounts};
use crate::figure::{Figure, table};
use crate::pair::quantile;
use crate::programs::{Failure, root};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Robots of three components each; in addition a camera and its viewer, the source of the time of
/// the first robot, and a component over DDS.
const ROBOTS: usize = 6;
/// The pause between two kills of components.
const BEAT: Duration = Duration::from_secs(1);
/// The lifetime of one `rcdeploy` process, in beats; at most a third of the run.
const LIFE: u64 = 30;
/// A restarted component is ready within this time.
const READY: Duration = Duration::from_secs(2);
/// The default deadline of calls, which holds for all calls here.
const DEADLINE: Duration = Duration::from_secs(1);
/// The other work in the function whose time is measured.
const BESIDE: Duration = Duration::from_millis(100);
/// Beyond this multiple of the deadline and of the longest time that the machine let a thread wait,
/// the machine is not an explanation for a late call: the run fails.
const SLACK: u32 = 5;
/// Time after which something hangs, on the slowest machine: the run fails.
const HANGS: Duration = Duration::from_mins(1);
/// The shortest life time of a guard.
const GUARDED: Duration = Duration::from_secs(6);
/// In how many of a hundred seconds there is other trouble.
const TROUBLED: usize = 15;
/// The sleep of the thread that measures how busy the machine is.
const NAP: Duration = Duration::from_millis(5);
/// Folders for networks on a disk, which a trouble keeps busy; the first one that exists.
const DISKS: [&str; 2] = ["/var/tmp", "/tmp"];

/// The measurements.
#[derive(Default)]
struct Seen {
    tally: Tally,
    supervisors: u32,
    guards: u32,
    /// From the restart of a killed component until it was ready.
    ready: Vec<Duration>,
    /// From the death of rcdeploy until the network was up again.
    up: Vec<Duration>,
    /// The longest `compute()` that contains a call.
    longest_call: Duration,
    hung: u32,
    /// How often a follower has reported that its time was set back.
    jumps: u32,
    /// Memory that grows steadily.
    growing: Vec<String>,
    troubles: Troubles,
    /// Times beyond a limit, with their time of day.
    late: Vec<String>,
}

pub(super) fn run(time: Duration, seed: u64) -> Result<(), Failure> {
    println!("chaos: {time:?}, seed {seed}");
    let disk = DISKS.map(Path::new).into_iter().find(|disk| disk.is_dir());
    let disk = disk.ok_or("there is no folder for temporary files")?;
    let mut ground = Ground::below(disk, mounts::logs())?;
    if let Err(why) = ground.add_shim() {
        println!("skipped: a clock of the system that jumps and a slow disk: {why}");
    }
    describe(&ground)?;
    let mut seen = Seen::default();
    let hostile = Hostile::start(seed)?;
    let pause = pauses();
    let outcome = storm(&ground, &mut Dice(seed), time.as_secs(), &pause, &mut seen);
    if let Err(error) = outcome.and_then(|()| ground.nothing_is_left()) {
        let (kills, log) = (seen.tally.kills, ground.log_end("rcdeploy"));
        let folder = ground.keep();
        return Err(format!(
            "seed {seed}, after {kills} kills: {error}\nits folder is kept: {}\nthe end of the log of rcdeploy:\n{log}",
            folder.display()
        )
        .into());
    }
    println!("a hostile peer sent {} messages of DDS", hostile.sent());
    seen.report(Duration::from_micros(pause.load(Ordering::Relaxed)));
    Ok(())
}

/// Starts to measure the scheduling delay of the machine, in µs, which no component can avoid.
fn pauses() -> Arc<AtomicU64> {
    let longest = Arc::new(AtomicU64::new(0));
    let measured = Arc::clone(&longest);
    std::thread::spawn(move || {
        while Arc::strong_count(&measured) > 1 {
            let start = Instant::now();
            std::thread::sleep(NAP);
            let more = start.elapsed().saturating_sub(NAP);
            measured.fetch_max(more.as_micros() as u64, Ordering::Relaxed);
        }
    });
    longest
}

/// Writes the network, and configurations with a short period for clients.
fn describe(ground: &Ground) -> Result<(), Failure> {
    let components = root().canonicalize()?.join("components");
    let file = ground.deployment();
    let usual = std::fs::read_to_string(components.join("avoider/etc/config.toml"))?;
    let quick = usual.replace("period = \"50ms\"", "period = \"20ms\"");
    if quick == usual {
        return Err("the period of the avoider is not where it was".into());
    }
    std::fs::write(file.with_file_name("quick.toml"), quick)?;
    let mut text = Text::new(&components);
    text.declare(&format!("time simulated by {CLOCK};"));
    text.component(CLOCK, "clock", "        parameters { wait false; };\n");
    let system = "        time system;\n";
    for robot in 0..ROBOTS {
        let time = if robot == 0 { "" } else { system };
        text.component(&format!("simulator{robot}"), "simulator", time);
        text.component(&format!("monitor{robot}"), "pose_monitor", time);
        let config = format!("        config \"quick.toml\";\n{time}");
        text.component(&format!("avoider{robot}"), "avoider", &config);
        for (user, slot) in [
            ("avoider", "Laser"),
            ("avoider", "DifferentialRobot"),
            ("avoider", "BatteryStatus"),
            ("monitor", "FullPoseEstimationPub"),
        ] {
            text.bind(
                &format!("{user}{robot}.{slot}"),
                &format!("simulator{robot}.{slot}"),
            );
        }
    }
    text.component("camera", "camera", system);
    text.component("image_monitor", "image_monitor", system);
    // With peers and without multicast, its ports are known.
    let dds = format!(
        "{system}        middleware dds {{ domain {}; interfaces \"lo\"; multicast off; peers \"127.0.0.1\"; }};\n",
        hostile::DOMAIN
    );
    let folder = root().canonicalize()?.join("components/interop");
    text.component_of(&folder, "interop", "interop", &dds);
    for slot in ["Oracle", "CameraDriver", "Reports", "Talk", "Orders"] {
        text.declare(&format!("external interop.{slot};"));
    }
    text.bind("image_monitor.Camera", "camera.Camera");
    text.bind("image_monitor.CameraPub", "camera.CameraPub");
    std::fs::write(file, text.end())?;
    Ok(())
}

/// Names of the components; those of clients begin with `avoider`.
fn names() -> Vec<String> {
    let of = |robot| ["simulator", "monitor", "avoider"].map(|name| format!("{name}{robot}"));
    let robots = (0..ROBOTS).flat_map(of);
    robots
        .chain(["camera", "image_monitor", CLOCK, "interop"].map(str::to_owned))
        .collect()
}

/// Runs for so many beats. `pause` is the longest time that the machine let a thread wait, in µs.
fn storm(
    ground: &Ground,
    dice: &mut Dice,
    beats: u64,
    pause: &AtomicU64,
    seen: &mut Seen,
) -> Result<(), Failure> {
    let (mut left, mut killed) = (beats, None);
    let life = LIFE.min(beats.div_ceil(3));
    loop {
        let mut network = Network::start(ground)?;
        if killed.is_some() && dice.falls(20) {
            // A kill during the start.
            let wait = dice.time(Duration::from_secs(1));
            network.listen_for(wait, seen)?;
            network.supervisor.kill()?;
            seen.supervisors += 1;
            killed = Some(Instant::now());
            continue;
        }
        network.await_up(seen)?;
        if let Some(killed) = killed.take() {
            seen.up.push(Instant::now().duration_since(killed));
        }
        for _ in 0..life.min(left) {
            network.beat(dice, seen)?;
        }
        left = left.saturating_sub(life);
        if left == 0 {
            return network.finish(pause, seen);
        }
        if dice.falls(30) {
            network.kill_guard(seen);
        }
        network.supervisor.kill()?;
        seen.supervisors += 1;
        killed = Some(Instant::now());
    }
}

/// One run of rcdeploy, and its events.
struct Network<'g> {
    ground: &'g Ground,
    supervisor: Supervisor,
    events: Receiver<Value>,
    is_up: bool,
    /// The start of its guard.
    guarded: Instant,
    /// Started components, with the start in milliseconds of the day.
    starting: BTreeMap<String, (i64, Instant)>,
    /// The trouble that is there, or was a moment ago.
    after: Consequence,
}

impl<'g> Network<'g> {
    fn start(ground: &'g Ground) -> Result<Self, Failure> {
        let mut supervisor = Supervisor::start_telling(ground, Stdio::piped())?;
        let output = BufReader::new(supervisor.events().ok_or("no pipe")?);
        let (sender, events) = channel();
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                // A killed process may leave half a line.
                let Ok(event) = serde_json::from_str(&line) else {
                    return;
                };
                if sender.send(event).is_err() {
                    return;
                }
            }
        });
        Ok(Self {
            ground,
            supervisor,
            events,
            is_up: false,
            guarded: Instant::now(),
            starting: BTreeMap::new(),
            after: Consequence::Nothing,
        })
    }

    fn await_up(&mut self, seen: &mut Seen) -> Result<(), Failure> {
        let end = Instant::now() + HANGS;
        while !self.is_up {
            if Instant::now() > end {
                return Err(format!("{NETWORK} is not up within {HANGS:?}").into());
            }
            self.listen_for(Duration::from_millis(5), seen)?;
        }
        Ok(())
    }

    /// Handles the events of this time.
    fn listen_for(&mut self, time: Duration, seen: &mut Seen) -> Result<(), Failure> {
        let end = Instant::now() + time;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match self.events.recv_timeout(left) {
                Ok(event) => self.take(&event, seen)?,
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err("rcdeploy has ended by itself".into());
                }
            }
        }
        let late = |(_, since): &&(i64, Instant)| since.elapsed() > HANGS;
        match self.starting.iter().find(|(_, start)| late(start)) {
            Some((name, _)) => Err(format!("{name} is not ready {HANGS:?} after its start").into()),
            None => Ok(()),
        }
    }

    fn take(&mut self, event: &Value, seen: &mut Seen) -> Result<(), Failure> {
        let text = |key: &str| event[key].as_str().unwrap_or_default();
        let (name, message) = (text("component"), text("message"));
        if message.contains(NO_DESCRIPTOR) {
            // It was left none; it tries again.
            self.starting.remove(name);
            return Ok(());
        }
        match text("code") {
            "up" => self.is_up = true,
            "starting" => {
                let start = (milliseconds(text("time"))?, Instant::now());
                self.starting.insert(name.to_owned(), start);
            }
            "ready" => {
                if let Some((start, _)) = self.starting.remove(name)
                    && self.is_up
                    && self.after == Consequence::Nothing
                {
                    const DAY: i64 = 24 * 60 * 60 * 1000;
                    let took = (milliseconds(text("time"))? - start).rem_euclid(DAY);
                    let took = Duration::from_millis(took as u64);
                    seen.ready.push(took);
                    seen.tally.recovered(took);
                    if took >= READY {
                        let late = format!("{}: {name}: ready after {took:?}", text("time"));
                        seen.late.push(late);
                    }
                }
            }
            "exited" if message.contains("SIGKILL") => {
                self.starting.remove(name);
            }
            "exited" | "start-failed" | "not-ready" if self.after == Consequence::Failures => {
                self.starting.remove(name);
                seen.troubles.fell();
            }
            "memory-growth" => {
                let grows = format!("{}: {name}: {message}", text("time"));
                seen.growing.push(grows);
            }
            "time-jumped" => seen.jumps += 1,
            // All components that were not killed must be alive.
            "exited" | "gave-up" | "start-failed" | "not-ready" | "link-closed" | "refused"
            | "guard-lost" | "not-written" => {
                return Err(format!("{name}: {message}").into());
            }
            "hung" => {
                seen.hung += 1;
                seen.late
                    .push(format!("{}: {name}: {message}", text("time")));
            }
            _ => {}
        }
        Ok(())
    }

    /// One second: kills one component, and sometimes once more during its restart.
    fn beat(&mut self, dice: &mut Dice, seen: &mut Seen) -> Result<(), Failure> {
        let end = Instant::now() + BEAT;
        let names = names();
        // The times that clients have measured so far.
        self.look_at_clients(&names, seen);
        if dice.falls(TROUBLED) {
            self.after = seen.troubles.make(self.ground, dice)?;
            if self.after != Consequence::Nothing {
                self.await_all(seen)?;
                // The thread that reads events may be behind.
                self.listen_for(BEAT, seen)?;
                self.after = Consequence::Nothing;
            }
        }
        let name = &names[dice.below(names.len())];
        let mut last = None;
        loop {
            let spread = quantile(&mut seen.ready, 0.5).max(Duration::from_millis(50));
            let wait = last.map_or(Duration::ZERO, |_| dice.time(spread));
            let (process, was_ready) = kill_one(self.ground, name, last, wait)?;
            seen.tally.kill(!was_ready);
            last = Some(process);
            if !dice.falls(40) {
                break;
            }
        }
        // rcdeploy gives up a guard that keeps ending early, as it must.
        if dice.falls(12) && self.guarded.elapsed() > GUARDED {
            self.guarded = Instant::now();
            self.kill_guard(seen);
        }
        self.listen_for(end.saturating_duration_since(Instant::now()), seen)
    }

    fn look_at_clients(&self, names: &[String], seen: &mut Seen) {
        for name in names.iter().filter(|name| name.starts_with("avoider")) {
            self.look_at(name, seen);
        }
    }

    fn look_at(&self, name: &str, seen: &mut Seen) {
        let Ok(status) = self.ground.status(name) else {
            return;
        };
        let work = &status["compute"];
        let longest = Duration::from_micros(work["max_us"].as_u64().unwrap_or(0));
        if longest > seen.longest_call {
            seen.longest_call = longest;
            if longest >= DEADLINE + BESIDE {
                seen.late
                    .push(format!("{name}: compute() with a query took {longest:?}"));
            }
        }
    }

    fn kill_guard(&self, seen: &mut Seen) {
        let status = self.ground.status("rcdeploy").unwrap_or_default();
        if let Some(guard) = pid(&status["guard"])
            && self.ground.kill(guard)
        {
            seen.guards += 1;
        }
    }

    /// Waits until all components are ready.
    fn await_all(&mut self, seen: &mut Seen) -> Result<(), Failure> {
        let end = Instant::now() + HANGS;
        loop {
            self.listen_for(Duration::from_millis(20), seen)?;
            let names = names();
            let missing: Vec<&String> = names
                .iter()
                .filter(|name| !self.ground.is_ready(name))
                .collect();
            if missing.is_empty() {
                return Ok(());
            }
            if Instant::now() > end {
                return Err(format!("not ready within {HANGS:?}: {missing:?}").into());
            }
        }
    }

    /// Waits until all components are ready once more, then stops the network.
    fn finish(mut self, pause: &AtomicU64, seen: &mut Seen) -> Result<(), Failure> {
        self.await_all(seen)?;
        self.look_at_clients(&names(), seen);
        let pause = Duration::from_micros(pause.load(Ordering::Relaxed));
        if seen.longest_call > (DEADLINE + BESIDE + pause) * SLACK {
            let (longest, deadline) = (seen.longest_call, DEADLINE);
            return Err(format!("a call with a deadline of {deadline:?} took {longest:?}").into());
        }
        self.supervisor.stop()
    }
}

/// Milliseconds of the day of a time in RFC 3339, UTC.
fn milliseconds(time: &str) -> Result<i64, Failure> {
    let clock = time
        .split_once('T')
        .map(|(_, clock)| clock.trim_end_matches('Z'));
    let clock = clock.ok_or_else(|| format!("{time} is not a time"))?;
    let mut total = 0.0;
    for part in clock.split(':') {
        total = total * 60.0 + part.parse::<f64>()?;
    }
    Ok((total * 1000.0).round() as i64)
}

impl Seen {
    fn report(mut self, pause: Duration) {
        let Tally {
            kills,
            during_start,
            ..
        } = self.tally;
        println!(
            "{kills} components were killed, {during_start} of them during start, rcdeploy {} times, its guard {} times",
            self.supervisors, self.guards
        );
        println!(
            "{}; followers found their time set back {} times",
            self.troubles, self.jumps
        );
        let ms = |time: Duration| format!("{:.0} ms", time.as_secs_f64() * 1e3);
        let three = |times: &mut [Duration]| {
            let [p50, p99, most] = [0.5, 0.99, 1.0].map(|part| quantile(times, part));
            (format!("{} / {} / {}", ms(p50), ms(p99), ms(most)), most)
        };
        let (ready, latest) = three(&mut self.ready);
        let (up, _) = three(&mut self.up);
        let met = table([
            Figure {
                what: "a component's new start until it is ready, p50 / p99 / longest",
                goal: "< 2 s",
                measured: format!("{ready} of {}", self.ready.len()),
                met: latest < READY,
            },
            Figure {
                what: "the longest `compute()` with a query whose deadline is 1 s",
                goal: "< 1.1 s",
                measured: ms(self.longest_call),
                met: self.longest_call < DEADLINE + BESIDE,
            },
            Figure {
                what: "death of rcdeploy until all are up again under the next one, p50 / p99 / longest",
                goal: "they get up",
                measured: format!("{up} of {}", self.up.len()),
                met: true,
            },
            Figure {
                what: "components that rcdeploy took for hung",
                goal: "none",
                measured: self.hung.to_string(),
                met: self.hung == 0,
            },
            Figure {
                what: "components whose memory grew steadily",
                goal: "none",
                measured: self.growing.len().to_string(),
                met: self.growing.is_empty(),
            },
        ]);
        for late in self.late.iter().chain(&self.growing) {
            println!("late: {late}");
        }
        let longest = ms(pause);
        println!(
            "the machine itself let a thread that slept {NAP:?} wait for {longest} more, at the most"
        );
        println!("chaos: no other component ended, all started again, nothing is left");
        if !met {
            eprintln!("xtask: a goal was missed");
        }
    }
}
