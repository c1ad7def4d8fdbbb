//! Tests a network whose guard is a script.

use super::*;
use std::cell::Cell;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

static NETWORKS: AtomicU32 = AtomicU32::new(0);
/// The longest wait of a test.
const LIMIT: Duration = Duration::from_mins(1);

/// Guards, says what the test wants, then answers reports until its farewell.
const GUARD: &str = r#"echo '"guarding"' >&0
printf "$0" >&0
while read -r line; do
    case $line in
    *clean_up*deaths*:0*) exit 9 ;;
    *clean_up*deaths*:1*) echo '{"cleaned":{"deaths":1}}' >&0 ;;
    *clean_up*deaths*:2*) echo '{"removed":{"component":"b"}}' >&0 ;;
    '"release"') echo '"released"' >&0 ;;
    '"farewell"') exit ;;
    esac
done"#;

fn service(users: &[&str]) -> Service {
    Service {
        address: "a".to_owned(),
        types: "T".to_owned(),
        hash: 1,
        topic: false,
        depth: 0,
        keeps: false,
        users: users.iter().map(|&user| user.to_owned()).collect(),
    }
}

fn held(count: usize) -> String {
    format!("{{\"held\":{{\"count\":{count}}}}}\n")
}

/// A guarded network, and the folder of its guard's log.
struct Net {
    network_guard: Option<NetworkGuard>,
    folder: tempfile::TempDir,
}

impl Net {
    /// A network whose guard runs this shell script. `says` is its `$0`.
    fn new(script: &str, says: &str, services: Vec<Service>) -> Self {
        let number = NETWORKS.fetch_add(1, Ordering::Relaxed);
        let network = format!("guarded-{}-{number}", std::process::id());
        let folder = tempfile::tempdir().expect("a folder");
        let lock = Lock::acquire(&network).expect("a lock");
        let command = GuardCommand {
            program: "/bin/sh".into(),
            args: ["-c", script, says].map(str::to_owned).into(),
        };
        let log = folder.path().join("guard.log");
        let network_guard =
            NetworkGuard::new(&network, lock, command, log, services).expect("a guarded network");
        Self {
            network_guard: Some(network_guard),
            folder,
        }
    }

    fn started(script: &str, says: &str, services: Vec<Service>) -> Self {
        let mut net = Self::new(script, says, services);
        net.network_guard().start_guard().expect("a guard");
        net
    }

    fn network_guard(&mut self) -> &mut NetworkGuard {
        self.network_guard.as_mut().expect("it is not dropped")
    }

    /// Takes turns until something is so.
    fn await_that(&mut self, is_so: impl Fn(&NetworkGuard) -> bool) {
        let limit = Instant::now() + LIMIT;
        let network_guard = self.network_guard();
        while !is_so(network_guard) {
            assert!(Instant::now() < limit, "it does not become so");
            std::thread::sleep(Duration::from_millis(1));
            network_guard.turn();
        }
    }

    /// Waits for the end of the guard, and takes note of it.
    fn guard_ended(&mut self) -> GuardChange {
        let guard = self.network_guard().descriptor().expect("a guard");
        let guard = guard.try_clone().expect("a copy");
        let ended = crate::process::identity::first_readable([&guard], LIMIT);
        assert!(ended.is_some(), "it does not end");
        self.network_guard().guard_ended().expect("it has ended")
    }

    fn kill_guard(&mut self) {
        let pid = self
            .network_guard()
            .guard()
            .and_then(rustix::process::Pid::from_raw);
        let pid = pid.expect("a guard");
        rustix::process::kill_process(pid, rustix::process::Signal::KILL).expect("it runs");
    }

    fn registry(&mut self) -> PathBuf {
        self.network_guard()
            .directory()
            .path()
            .join("components.json")
    }
}

impl Drop for Net {
    fn drop(&mut self) {
        if let Some(network_guard) = self.network_guard.take() {
            let directory = network_guard.directory().path().to_owned();
            let called = Cell::new(false);
            let (left, removed, lock) = network_guard.finish(&|| called.set(true));
            drop(lock);
            if !std::thread::panicking() {
                assert!(called.get() && removed.is_ok() && left == 0);
                assert!(!directory.exists());
            }
        }
    }
}

fn process(name: &str, pid: i32) -> RegisteredProcess {
    RegisteredProcess {
        name: name.to_owned(),
        process: Identity { pid, starttime: 1 },
        stop_ms: 100,
    }
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_default()
}

#[test]
fn a_component_starts_when_its_services_are_held() {
    let services = vec![service(&["a"]), service(&["a", "b"]), service(&["c"])];
    let mut net = Net::new(GUARD, &held(2), services);
    let lets = |network_guard: &NetworkGuard| {
        ["x", "a", "b", "c"].map(|name| network_guard.lets_start(name))
    };
    assert_eq!(
        lets(net.network_guard()),
        [false; 4],
        "there is no guard yet"
    );
    net.network_guard().start_guard().expect("a guard");
    assert_eq!(lets(net.network_guard()), [false; 4]);
    net.await_that(|network_guard| network_guard.held == Some(2));
    assert_eq!(lets(net.network_guard()), [true, true, true, false]);
    // The files of an earlier guard exist.
    net.kill_guard();
    let changed = net.guard_ended();
    assert!(matches!(changed, GuardChange::Restarted(_)));
    assert_eq!(lets(net.network_guard()), [true, true, true, false]);
}

#[test]
fn a_component_starts_again_when_the_guard_has_cleaned_up_after_it() {
    let mut net = Net::started(GUARD, "", Vec::new());
    net.await_that(|network_guard| network_guard.held.is_some());
    for (name, pid) in [("a", 1), ("b", 2), ("c", 3)] {
        net.network_guard().started(process(name, pid));
    }
    net.network_guard().ended("a", true);
    assert!(!net.network_guard().lets_start("a") && net.network_guard().lets_start("b"));
    let guard = net.network_guard().guard.as_ref().and_then(Guard::patience);
    assert!(guard.is_some() && net.network_guard().deadline() == guard);
    net.await_that(|network_guard| network_guard.lets_start("a"));
    assert_eq!(net.network_guard().deadline(), None);
    // The second clean-up goes on, and is done with `b`.
    net.network_guard().ended("b", true);
    assert!(!net.network_guard().lets_start("b"));
    net.await_that(|network_guard| network_guard.lets_start("b"));
    // At the end of the network there is none.
    net.network_guard().ended("c", false);
    assert!(net.network_guard().lets_start("c"));
    assert_eq!(net.network_guard().deaths, 2);
    net.network_guard().ended("unknown", true);
    assert_eq!(net.network_guard().deaths, 2);
}

#[test]
fn a_new_guard_cleans_up_after_all() {
    let mut net = Net::started(GUARD, "", Vec::new());
    net.await_that(|network_guard| network_guard.held.is_some());
    net.kill_guard();
    net.network_guard().started(process("a", 1));
    net.network_guard().ended("a", true);
    let _ = net.guard_ended();
    assert!(!net.network_guard().lets_start("a"));
    net.await_that(|network_guard| network_guard.lets_start("a"));
}

#[test]
fn the_registry_is_written_when_it_has_changed() {
    let mut net = Net::new(GUARD, "", Vec::new());
    let file = net.registry();
    assert!(
        text(&file).contains("\"components\":[]"),
        "a later `up` finds it"
    );
    std::fs::remove_file(&file).expect("a file");
    net.network_guard().save().expect("it is written");
    assert!(!file.exists());
    net.network_guard().started(process("a", 1));
    net.network_guard().save().expect("it is written");
    assert!(text(&file).contains("\"a\""));
    net.network_guard().ended("a", false);
    net.network_guard().save().expect("it is written");
    assert!(text(&file).contains("\"components\":[]"));
    std::fs::remove_file(&file).expect("a file");
    net.network_guard().save().expect("it is written");
    assert!(!file.exists());
}

#[test]
fn a_first_guard_that_never_guards_is_not_replaced() {
    let mut net = Net::started("exit 7", "", Vec::new());
    let GuardChange::NotStarted(why) = net.guard_ended() else {
        panic!("it has never guarded");
    };
    let log = net.folder.path().join("guard.log");
    let expected = format!("exit status: 7; see {}", log.display());
    assert!(why.starts_with(&expected), "{why}");
    assert_eq!(net.network_guard().guard(), None);
    assert!(net.network_guard().guard_ended().is_none());
    assert!(net.network_guard().descriptor().is_none() && net.network_guard().link().is_none());
}

#[test]
fn a_guard_that_ends_again_and_again_is_given_up() {
    let mut net = Net::started(GUARD, "", vec![service(&["a"])]);
    net.await_that(|network_guard| network_guard.held.is_some());
    for _ in 1..GUARD_STARTS {
        let first = net.network_guard().guard().expect("a guard");
        net.kill_guard();
        let GuardChange::Restarted(why) = net.guard_ended() else {
            panic!("there is a new one");
        };
        assert!(why.contains("SIGKILL"), "{why}");
        assert_ne!(net.network_guard().guard(), Some(first));
    }
    assert!(!net.network_guard().lets_start("a"));
    net.kill_guard();
    let GuardChange::Lost(why) = net.guard_ended() else {
        panic!("it is given up");
    };
    assert!(why.contains("is not started any more"), "{why}");
    assert!(
        net.network_guard().lets_start("a"),
        "components do without a guard"
    );
}

#[test]
fn an_agent_waits_until_all_services_are_held() {
    let services = || vec![service(&["a"]), service(&["b"])];
    let pause = Duration::from_millis(20);
    let mut net = Net::started(GUARD, &held(2), services());
    let mut beats = 0;
    let mut beat = || {
        beats += 1;
        Ok(())
    };
    net.network_guard()
        .await_services(pause, &mut beat)
        .expect("they are held");
    assert_eq!(net.network_guard().held, Some(2));
    net.network_guard()
        .await_services(pause, &mut beat)
        .expect("they are held");
    assert!(beats > 0);
    // One is never held.
    let mut net = Net::started(GUARD, &held(1), services());
    let mut beats = 0;
    let ended = net.network_guard().await_services(pause, || {
        beats += 1;
        if beats < 5 {
            Ok(())
        } else {
            Err(Error::NoSecret)
        }
    });
    assert!(matches!(ended, Err(Error::NoSecret)));
    let mut net = Net::started("exit 7", "", services());
    let ended = net.network_guard().await_services(pause, || Ok(()));
    assert!(matches!(ended, Err(Error::Guard(why)) if why.starts_with("exit status: 7")));
    // Without a guard there is nothing to wait for.
    net.network_guard()
        .await_services(pause, || Ok(()))
        .expect("no guard");
}

#[test]
fn a_guard_that_is_stuck_is_killed_at_its_deadline() {
    let mut net = Net::started(GUARD, "", vec![service(&["a"])]);
    net.await_that(|network_guard| network_guard.held.is_some());
    let deadline = net.network_guard().deadline().expect("it is busy");
    net.network_guard().check(deadline);
    let GuardChange::Restarted(why) = net.guard_ended() else {
        panic!("there is a new one");
    };
    assert!(why.contains("has created 0 of 1 services"), "{why}");
}

#[test]
fn processes_that_do_not_end_are_killed() {
    let mut net = Net::new(GUARD, "", Vec::new());
    let mut child = std::process::Command::new("sleep");
    let mut child = child.arg("600").spawn().expect("it starts");
    let identity = Identity::of(child.id().try_into().expect("a pid")).expect("it runs");
    let sleeps = RegisteredProcess {
        process: identity,
        ..process("a", 1)
    };
    net.network_guard().started(sleeps);
    assert_eq!(net.network_guard().end_all(), 1);
    assert!(!child.wait().expect("it has ended").success());
    assert_eq!(net.network_guard().end_all(), 0, "they are forgotten");
}
