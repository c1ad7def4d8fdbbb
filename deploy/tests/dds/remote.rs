//! `rcdeploy up` on one host, and the simulator on another one, behind a real ssh server: two
//! network namespaces with a cable between them.

use crate::{await_well, place, rcdeploy, tools};
use rc_middleware::RunDirectory;
use rc_test_site::site::{PATROL, Site};
use rc_test_support::cable::{Cable, cable, install, run};
use rc_test_support::python::skipped;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// The ssh server of Debian. It refuses to start without its absolute path.
const SSHD: &str = "/usr/sbin/sshd";

/// Where an ssh server listens, and for whom.
pub(crate) struct Server<'s> {
    pub(crate) listen: &'s str,
    /// The address by which the other host knows it.
    pub(crate) known_as: &'s str,
    /// The home folder of its user, if it is another one than here.
    pub(crate) home: Option<PathBuf>,
}

/// A host with an ssh server that accepts one key.
pub(crate) struct Robot {
    sshd: Child,
    folder: PathBuf,
}

impl Robot {
    /// Starts the server on the second host. The error says why this machine cannot.
    pub(crate) fn start(site: &Site, cable: &Cable) -> Result<Self, String> {
        let server = Server {
            listen: "10.77.0.2",
            known_as: "10.77.0.2",
            home: None,
        };
        Self::serve(site, cable, &server)
    }

    /// Starts a server on the second host. The error says why this machine cannot.
    pub(crate) fn serve(site: &Site, cable: &Cable, server: &Server<'_>) -> Result<Self, String> {
        if !Path::new(SSHD).exists() {
            install(&["openssh-server", "openssh-client"])?;
        }
        // Its working directory before a login.
        fs::create_dir_all("/run/sshd").map_err(|e| format!("/run/sshd: {e}"))?;
        let folder = site.path("robot");
        for name in ["run", "state", "cache"] {
            fs::create_dir_all(folder.join(name)).expect("a folder");
        }
        let path = |name: &str| folder.join(name).display().to_string();
        for key in ["host_key", "user_key", "other_key"] {
            run(
                "ssh-keygen",
                &["-q", "-t", "ed25519", "-N", "", "-f", &path(key)],
            )?;
        }
        let public = |key: &str| fs::read_to_string(path(&format!("{key}.pub"))).expect("a key");
        fs::write(path("authorized_keys"), public("user_key")).expect("written");
        fs::write(
            path("known_hosts"),
            format!("{} {}", server.known_as, public("host_key")),
        )
        .expect("written");
        let home = server.home.as_ref();
        let home = home.map_or_else(String::new, |home| format!(" HOME={}", home.display()));
        let config = format!(
            "Port 22\nListenAddress {}\nHostKey {}\nAuthorizedKeysFile {}\nPidFile none\n\
             UsePAM no\nStrictModes no\nPasswordAuthentication no\nPermitRootLogin yes\n\
             SetEnv XDG_RUNTIME_DIR={} XDG_STATE_HOME={} XDG_CACHE_HOME={} \"PATH={}\"{home}\n",
            server.listen,
            path("host_key"),
            path("authorized_keys"),
            path("run"),
            path("state"),
            path("cache"),
            // That of a login may have another Python.
            std::env::var("PATH").expect("a path"),
        );
        fs::write(path("sshd_config"), config).expect("written");
        let log = fs::File::create(path("sshd.log")).expect("a log");
        let sshd = Command::new("ip")
            .args(["netns", "exec", cable.name(1), SSHD, "-D", "-e", "-f"])
            .arg(path("sshd_config"))
            .stdin(Stdio::null())
            .stderr(log)
            .spawn()
            .map_err(|e| format!("ip: {e}"))?;
        let robot = Self {
            sshd,
            folder: folder.clone(),
        };
        robot.let_in("user_key");
        Site::until("sshd listens", || {
            fs::read_to_string(path("sshd.log")).is_ok_and(|log| log.contains("listening on"))
        });
        Ok(robot)
    }

    fn stop(&mut self) {
        let _ = self.sshd.kill();
        let _ = self.sshd.wait();
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Sets the key of the client.
    fn let_in(&self, key: &str) {
        let path = |name: &str| self.path(name).display().to_string();
        let config = format!(
            "Host *\nIdentityFile {}\nIdentitiesOnly yes\nUserKnownHostsFile {}\nStrictHostKeyChecking yes\n",
            path(key),
            path("known_hosts"),
        );
        fs::write(self.path("ssh_config"), config).expect("written");
    }

    pub(crate) fn ssh(&self) -> String {
        format!("ssh -F {}", self.path("ssh_config").display())
    }

    fn run_directory(&self, site: &Site) -> PathBuf {
        self.path("run/robocomp").join(&site.network)
    }

    /// Waits for the end of its agent, of which the supervisor waits for the last word only.
    pub(crate) fn await_nothing_left(&self, site: &Site) {
        Site::until("the end of the agent", || {
            !self.run_directory(site).exists() && processes(&self.path("cache")).is_empty()
        });
    }

    fn assert_nothing_left(&self, site: &Site) {
        assert!(!self.run_directory(site).exists());
        assert_eq!(processes(&self.path("cache")), Vec::<String>::new());
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        self.stop();
    }
}

/// The command lines of processes whose program or arguments name a folder.
fn processes(folder: &Path) -> Vec<String> {
    let folder = folder.display().to_string();
    let entries = fs::read_dir("/proc").expect("processes").flatten();
    let commands = entries.filter_map(|entry| fs::read(entry.path().join("cmdline")).ok());
    let commands = commands.map(|bytes| String::from_utf8_lossy(&bytes).replace('\0', " "));
    commands
        .filter(|command| command.contains(&folder))
        .collect()
}

/// The patrol with its simulator on the robot.
fn patrol(
    name: &str,
    domain: u32,
    cable: &Cable,
    robot: &mut Option<Robot>,
) -> Result<Site, String> {
    let network = PATROL
        .replace(
            "middleware iceoryx2;",
            "Host robot { address \"10.77.0.2\"; user \"root\"; };",
        )
        .replace(
            "cdsl \"../simulator/simulator.cdsl\";",
            "cdsl \"../simulator/simulator.cdsl\"; host robot; restart on_failure backoff 100ms;",
        );
    let mut site = place(name, domain, &network);
    *robot = Some(Robot::start(&site, cable)?);
    let within = ["ip", "netns", "exec", cable.name(0)];
    site.within = within.map(str::to_owned).to_vec();
    Ok(site)
}

struct Up {
    child: Child,
    log: PathBuf,
}

impl Up {
    fn start(site: &Site, robot: &Robot) -> Self {
        Self::run(site, robot, rcdeploy(site, &["up", "--format", "json"]))
    }

    fn run(site: &Site, robot: &Robot, mut command: Command) -> Self {
        let log = site.path("up.log");
        let output = fs::File::create(&log).expect("a log");
        command.env("RC_SSH", robot.ssh());
        command.stdout(output).stderr(Stdio::inherit());
        let child = command.spawn().expect("rcdeploy");
        Self { child, log }
    }

    /// The messages of all events with this code so far.
    fn events(&self, code: &str) -> Vec<String> {
        let text = fs::read_to_string(&self.log).unwrap_or_default();
        let events = text
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok());
        let events = events.filter(|event| event["code"] == code);
        events
            .map(|event| event["message"].as_str().unwrap_or_default().to_owned())
            .collect()
    }

    fn await_event(&self, code: &str) -> String {
        Site::until(code, || !self.events(code).is_empty());
        self.events(code).remove(0)
    }

    fn end(mut self) -> Option<i32> {
        self.child.wait().expect("a child").code()
    }

    fn interrupt(self) -> Option<i32> {
        kill_process(Pid::from_child(&self.child), Signal::INT).expect("to stop it");
        self.end()
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(crate) fn component(site: &Site, name: &str) -> Value {
    let status = site.status();
    let components = status["components"].as_array().expect("a list");
    components
        .iter()
        .find(|c| c["name"] == name)
        .expect("it")
        .clone()
}

fn poses(site: &Site) -> u64 {
    let slot = &site.ask("monitor", "status")["slots"][0];
    slot["handlers"]["count"].as_u64().expect("a count")
}

/// Waits until calls and poses go over the cable.
fn await_patrol(site: &Site) {
    await_well(site, "avoider");
    let before = poses(site);
    Site::until("poses come", || poses(site) > before);
}

#[test]
fn a_host_is_lost_and_comes_back() {
    let test = "a_host_is_lost_and_comes_back";
    let Some(cable) = cable(test) else { return };
    let mut robot = None;
    let site = match patrol("remote", 177, &cable, &mut robot) {
        Ok(site) => site,
        Err(reason) => return skipped(test, &reason),
    };
    let robot = robot.expect("it runs");
    let up = Up::start(&site, &robot);
    up.await_event("up");
    // rcdeploy, the simulator, its configuration and its map.
    assert!(
        up.await_event("host-connected")
            .contains("4 files were copied")
    );
    await_patrol(&site);
    let simulator = component(&site, "simulator");
    assert_eq!(
        (&simulator["host"], &simulator["state"]),
        (&"robot".into(), &"running".into())
    );
    assert!(!site.log("simulator").is_empty());
    assert!(robot.run_directory(&site).is_dir());
    // Its management socket is here, too.
    assert_eq!(site.ask("simulator", "status")["middleware"], "dds");
    let get = site.rcdeploy(
        &["params", "get", &site.network, "simulator", "seed"],
        false,
    );
    assert_eq!(
        (get.code, get.stdout.as_str()),
        (0, "seed = 1\n"),
        "{get:?}"
    );

    tools::look(&site, "dds");
    tools::delay(&site, "robot");
    tools::bench(&site);

    cable.set(1, "down");
    up.await_event("host-lost");
    assert_eq!(component(&site, "simulator")["state"], "waiting");
    assert!(!site.directory().socket("simulator").exists());
    assert_eq!(component(&site, "avoider")["state"], "running");
    Site::until("nothing of it runs there", || {
        processes(&robot.path("cache")).is_empty() && !robot.run_directory(&site).exists()
    });
    cable.set(1, "up");
    assert!(
        up.await_event("host-back")
            .contains("nothing had to be copied")
    );
    await_patrol(&site);
    assert_eq!(component(&site, "simulator")["restarts"], 1);
    assert_eq!(site.ask("simulator", "status")["state"], "running");

    assert_eq!(up.interrupt(), Some(0));
    site.assert_nothing_left();
    robot.assert_nothing_left(&site);
}

/// Tools get what is in the shared memory of another host over the connection of its agent.
#[test]
fn tools_reach_the_shared_memory_of_another_host() {
    let test = "tools_reach_the_shared_memory_of_another_host";
    let Some(cable) = cable(test) else { return };
    let mut site = Site::new("memory");
    let host = "Host robot { address \"10.77.0.2\"; user \"root\"; };";
    let network = PATROL
        .replace("iceoryx2;", &format!("iceoryx2;\n    {host}"))
        .replace(".cdsl\";", ".cdsl\"; host robot;");
    site.write_ddsl(&network);
    let robot = match Robot::start(&site, &cable) {
        Ok(robot) => robot,
        Err(reason) => return skipped(test, &reason),
    };
    site.within = ["ip", "netns", "exec", cable.name(0)]
        .map(str::to_owned)
        .to_vec();
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(["up", "--format", "json", "--profile", "dev"]);
    command.arg(site.ddsl());
    let up = Up::run(&site, &robot, command);
    up.await_event("up");
    await_patrol(&site);
    assert_eq!(component(&site, "simulator")["host"], "robot");
    tools::look(&site, "iceoryx2");
    tools::delay(&site, "robot");
    heals(&site, &robot, &up);
    assert_eq!(up.interrupt(), Some(0));
    site.assert_nothing_left();
    robot.assert_nothing_left(&site);
}

/// An adaptor runs on the host of its consumer, with the program that is copied there.
#[test]
fn an_adaptor_runs_on_another_host() {
    let test = "an_adaptor_runs_on_another_host";
    let Some(cable) = cable(test) else { return };
    let mut site = Site::new("far_adaptor");
    for program in ["rcforward", "simulator", "pose_listener"] {
        Site::executable(program);
    }
    site.write_ddsl(
        "Deployment patrol\n{\n    middleware iceoryx2;\n    Host robot { address \"10.77.0.2\"; user \"root\"; };\n    \
         Component simulator { cdsl \"../simulator/simulator.cdsl\"; host robot; };\n    \
         Component listener { cdsl \"../pose_listener/pose_listener.cdsl\"; host robot; };\n    \
         bind listener.ros -> simulator.FullPoseEstimationPub { convert via process; };\n};\n",
    );
    let robot = match Robot::start(&site, &cable) {
        Ok(robot) => robot,
        Err(reason) => return skipped(test, &reason),
    };
    site.within = ["ip", "netns", "exec", cable.name(0)]
        .map(str::to_owned)
        .to_vec();
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(["up", "--format", "json", "--profile", "dev"]);
    command.arg(site.ddsl());
    let up = Up::run(&site, &robot, command);
    up.await_event("up");
    let adaptor = "listener_ros_adaptor";
    assert_eq!(component(&site, adaptor)["host"], "robot");
    let copied = processes(&robot.path("cache"));
    assert!(
        copied.iter().any(|command| command.contains("rcforward")),
        "{copied:?}"
    );
    Site::until("poses go through the adaptor", || {
        let count = |name: &str, slot: usize| {
            let slot = &site.ask(name, "status")["slots"][slot];
            slot["handlers"]["count"].as_u64().unwrap_or_default()
        };
        count("listener", 0) > 2
    });
    Site::until("the adaptor counts them", || {
        let forwarded = component(&site, adaptor)["forwarded"].clone();
        let mut slots = forwarded.as_object().into_iter().flatten();
        slots.any(|(_, slot)| slot["messages"].as_u64() > Some(0))
    });
    assert_eq!(up.interrupt(), Some(0));
    site.assert_nothing_left();
    robot.assert_nothing_left(&site);
}

/// The shared memory of the robot is removed: its components restart in order.
fn heals(site: &Site, robot: &Robot, up: &Up) {
    let directory = RunDirectory::below(&robot.path("run/robocomp"), &site.network);
    let memory = rc_iceoryx2::leftovers(&directory).into_iter();
    let memory: Vec<_> = memory.filter(|path| path.starts_with("/dev/shm")).collect();
    assert!(!memory.is_empty(), "{directory:?}");
    let before = component(site, "simulator")["pid"].clone();
    for path in memory {
        // A component may have removed it in the meantime.
        let _ = fs::remove_file(path);
    }
    let lost = up.await_event("memory-lost");
    assert!(lost.starts_with("host robot: shared memory"), "{lost}");
    up.await_event("memory-back");
    assert_ne!(component(site, "simulator")["pid"], before);
    assert_eq!(site.status()["troubles"], serde_json::json!([]));
    await_patrol(site);
}

#[test]
fn a_refused_login_says_what_to_do() {
    let test = "a_refused_login_says_what_to_do";
    let Some(cable) = cable(test) else { return };
    let mut robot = None;
    let site = match patrol("no_key", 178, &cable, &mut robot) {
        Ok(site) => site,
        Err(reason) => return skipped(test, &reason),
    };
    let mut robot = robot.expect("it runs");
    let told = |robot: &Robot| {
        let up = Up::start(&site, robot);
        let told = up.await_event("host-unreachable");
        assert_eq!(up.end(), Some(3));
        told
    };
    robot.let_in("other_key");
    let no_key = told(&robot);
    assert!(no_key.contains("`ssh-copy-id root@10.77.0.2`"), "{no_key}");
    robot.let_in("user_key");
    fs::write(robot.path("known_hosts"), "").expect("written");
    let no_host = told(&robot);
    assert!(no_host.contains("`ssh root@10.77.0.2 true`"), "{no_host}");
    robot.stop();
    let no_sshd = told(&robot);
    assert!(no_sshd.contains("does its sshd run"), "{no_sshd}");
    site.assert_nothing_left();
}
