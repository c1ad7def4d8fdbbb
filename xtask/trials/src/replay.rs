//! `cargo xtask soak replay`: the patrol in simulated time is recorded exactly for an hour of its
//! own time, and each component is replayed from its recording. All runs must be equal.

use crate::figure::BUILD;
use crate::programs::{Failure, cargo, finish, output, root, target};
use rc_deploy_network::Profile;
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

/// The poses that the simulator publishes in a second of its time.
const POSES_A_SECOND: u64 = 20;
/// The components that are recorded.
const RECORDED: [&str; 4] = ["simulator", "monitor", "avoider", "clock"];
/// The limit of a command that starts or stops the network.
const COMMAND: Duration = Duration::from_mins(2);
/// How much longer than its simulated time the patrol may take, and each component again.
const PATIENCE: u32 = 4;
/// The least limit for that.
const LEAST: Duration = Duration::from_mins(5);
/// The pause between two looks whether the patrol is over.
const LOOK: Duration = Duration::from_millis(200);

/// Builds the components and runs for `seconds` of simulated time.
pub(crate) fn run(seconds: u64) -> Result<(), Failure> {
    let words =
        "build --release -p simulator -p pose_monitor -p avoider -p clock -p rc-deploy --bins";
    finish(cargo(&words.split(' ').collect::<Vec<_>>())?, BUILD)?;
    patrol(seconds, Profile::Release)
}

/// A short run with the components that the test run has built.
pub(crate) fn smoke() -> Result<(), Failure> {
    patrol(60, Profile::Dev)
}

/// The folders of a run.
struct Place {
    folder: tempfile::TempDir,
    network: String,
    profile: Profile,
}

impl Place {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `rcdeploy` with these arguments.
    fn rcdeploy(&self, args: &[&str]) -> Result<Command, Failure> {
        let mut command = Command::new(target()?.join(self.profile.folder()).join("rcdeploy"));
        command
            .args(args)
            .current_dir(self.path("networks"))
            .env("CARGO_TARGET_DIR", target()?)
            .env("XDG_RUNTIME_DIR", self.path("run"))
            .env("XDG_STATE_HOME", self.path("state"));
        Ok(command)
    }

    fn recording(&self, component: &str) -> PathBuf {
        let folder = self.path("state/robocomp").join(&self.network);
        folder.join(format!("{component}.exact.mcap"))
    }
}

/// Ends a network that is left after an error.
impl Drop for Place {
    fn drop(&mut self) {
        if let Ok(command) = self.rcdeploy(&["down", &self.network]) {
            let _ = output(command, COMMAND);
        }
    }
}

fn patrol(seconds: u64, profile: Profile) -> Result<(), Failure> {
    let place = Place {
        folder: tempfile::tempdir()?,
        network: format!("replay_{}", std::process::id()),
        profile,
    };
    for folder in ["run", "networks"] {
        std::fs::create_dir_all(place.path(folder))?;
    }
    write(&place, seconds * POSES_A_SECOND)?;
    let begin = Instant::now();
    let up = ["up", "--detach", "--profile", profile.word(), "patrol.ddsl"];
    finish(place.rcdeploy(&up)?, COMMAND)?;
    let limit = LEAST.max(Duration::from_secs(seconds) * PATIENCE);
    while !is_done(&place)? {
        if begin.elapsed() > limit {
            return Err(format!("the patrol is not over after {limit:?}").into());
        }
        std::thread::sleep(LOOK);
    }
    finish(place.rcdeploy(&["down", &place.network])?, COMMAND)?;
    let took = begin.elapsed().as_secs_f64();
    println!("{seconds} s of simulated time in {took:.0} s");
    let mut different = Vec::new();
    for component in RECORDED {
        let file = place.recording(component);
        let bytes = std::fs::metadata(&file)?.len();
        let name = file.display().to_string();
        let again = Instant::now();
        let replay = place.rcdeploy(&["replay", "--check", "--format", "json", &name])?;
        // A run that differs is reported with exit code 1.
        let report = output(replay, limit).map_err(|error| format!("{component}: {error}"));
        let report: Value = match report {
            Ok(printed) => serde_json::from_str(&printed)?,
            Err(error) => {
                different.push(error);
                continue;
            }
        };
        let number = |key: &str| report[key].as_u64().unwrap_or_default();
        println!(
            "{component}: {} turns, {} results compared, equal, in {:.1} s; {} bytes",
            number("turns"),
            number("compared"),
            again.elapsed().as_secs_f64(),
            bytes
        );
    }
    if different.is_empty() {
        Ok(())
    } else {
        Err(different.join("; ").into())
    }
}

/// Writes the network and the configurations of its components.
fn write(place: &Place, poses: u64) -> Result<(), Failure> {
    let components = root().join("components");
    let cdsl = |name: &str| {
        let path = components.join(name).join(format!("{name}.cdsl"));
        format!("cdsl \"{}\";", path.display())
    };
    let exact = "record { exact; };";
    let text = format!(
        "Deployment {}\n{{\n    time simulated by clock;\n\n    \
         Component simulator {{ {} {exact} }};\n    \
         Component monitor {{ {} config \"monitor.toml\"; {exact} }};\n    \
         Component avoider {{ {} {exact} }};\n    \
         Component clock {{ {} config \"clock.toml\"; {exact} }};\n\n    \
         bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;\n}};\n",
        place.network,
        cdsl("simulator"),
        cdsl("pose_monitor"),
        cdsl("avoider"),
        cdsl("clock"),
    );
    std::fs::write(place.path("networks/patrol.ddsl"), text)?;
    let map = components.join("maps/house.map");
    let monitor = format!(
        "[parameters]\nmap = \"{}\"\nsvg = \"\"\ntrace = \"\"\nsamples = {poses}\n",
        map.display()
    );
    std::fs::write(place.path("networks/monitor.toml"), monitor)?;
    let clock = "[parameters]\nstep = \"50ms\"\nrate = 0.0\nlimit = \"2s\"\n";
    std::fs::write(place.path("networks/clock.toml"), clock)?;
    Ok(())
}

/// Whether the monitor has seen all poses and has ended.
fn is_done(place: &Place) -> Result<bool, Failure> {
    let status = place.rcdeploy(&["status", "--format", "json", &place.network])?;
    let status: Value = serde_json::from_str(&output(status, COMMAND)?)?;
    let components = status["components"].as_array().cloned().unwrap_or_default();
    let monitor = components.iter().find(|c| c["name"] == "monitor");
    let state = monitor.and_then(|monitor| monitor["state"].as_str());
    match state {
        Some("done") => Ok(true),
        Some("running" | "starting" | "waiting" | "stopping") => Ok(false),
        other => Err(format!("the monitor is {other:?}").into()),
    }
}
