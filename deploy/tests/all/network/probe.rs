//! `--probe`, and notifications of a service manager.

use rc_test_site::site::Site;
use rustix::process::{Signal, kill_process};
use std::os::unix::net::UnixDatagram;
use std::time::Duration;

#[test]
fn a_probe_distinguishes_ready_stopped_and_absent() {
    let site = Site::new("probe");
    let network = site.network.clone();
    let probe = |more: &[&str]| {
        site.component(
            "simulator",
            &[&["--probe", "--network", &network], more].concat(),
        )
    };
    let nobody = probe(&[]);
    assert_eq!(
        (nobody.code, nobody.stdout.as_str()),
        (3, "simulator: not there\n")
    );

    // The probe starts before the component.
    let running = std::thread::scope(|scope| {
        let waiting = scope.spawn(|| probe(&["--wait", "15"]));
        let running = site.start("simulator", &[]);
        let ready = waiting.join().expect("it ends");
        assert_eq!(
            (ready.code, ready.stdout.as_str()),
            (0, "simulator: running\n")
        );
        running
    });
    assert_eq!(probe(&["--name", "other"]).code, 3);

    kill_process(running.pid(), Signal::STOP).expect("it is ours");
    // A thread that runs at this moment may still answer.
    let threads = format!("/proc/{}/task", running.pid().as_raw_nonzero());
    Site::until("the component stands still", || {
        let mut threads = std::fs::read_dir(&threads).expect("it runs");
        threads.all(|thread| {
            let stat = thread.expect("a thread").path().join("stat");
            let text = std::fs::read_to_string(stat).expect("it runs");
            let state = text.rsplit_once(") ");
            state.is_some_and(|(_, state)| state.starts_with('T'))
        })
    });
    let silent = probe(&[]);
    assert_eq!(silent.code, 1, "{silent:?}");
    assert!(
        silent.stdout.contains("has not answered within 2s"),
        "{silent:?}"
    );
    kill_process(running.pid(), Signal::CONT).expect("it is ours");
    assert_eq!(probe(&["--wait", "15"]).code, 0);

    // The socket of the killed component still exists.
    kill_process(running.pid(), Signal::KILL).expect("it is ours");
    assert_eq!(running.end(), None);
    assert_eq!(probe(&[]).code, 3);

    let wrong = site.component("simulator", &["--wait", "1"]);
    assert_eq!(wrong.code, 2);
    assert!(
        wrong.stderr.contains("--wait goes with --probe"),
        "{wrong:?}"
    );
}

#[test]
fn a_service_manager_is_notified_of_readiness_and_stop() {
    let site = Site::new("notify");
    let path = site.path("manager");
    let manager = UnixDatagram::bind(&path).expect("a socket");
    manager
        .set_read_timeout(Some(Duration::from_secs(20)))
        .expect("a limit");
    let hear = || {
        let mut bytes = [0; 64];
        let count = manager.recv(&mut bytes).expect("a message");
        String::from_utf8_lossy(&bytes[..count]).into_owned()
    };
    let variable = ("NOTIFY_SOCKET", path.to_str().expect("UTF-8"));
    let running = site.start_with("simulator", &[], &[variable]);
    assert_eq!(hear(), "READY=1");
    kill_process(running.pid(), Signal::TERM).expect("it is ours");
    assert_eq!(hear(), "STOPPING=1");
    assert_eq!(running.end(), Some(0));
}

#[test]
fn a_busy_service_manager_is_notified() {
    let site = Site::new("busy");
    let path = site.path("manager");
    let manager = UnixDatagram::bind(&path).expect("a socket");
    manager
        .set_read_timeout(Some(Duration::from_secs(20)))
        .expect("a limit");
    // Many components start at once, and the service manager does not read.
    let others = UnixDatagram::unbound().expect("a socket");
    others.set_nonblocking(true).expect("it can be");
    while others.send_to(b"noise", &path).is_ok() {}
    let variable = ("NOTIFY_SOCKET", path.to_str().expect("UTF-8"));
    let running = site.start_with("simulator", &[], &[variable]);
    loop {
        let mut bytes = [0; 64];
        let count = manager.recv(&mut bytes).expect("a message");
        if &bytes[..count] == b"READY=1" {
            break;
        }
        assert_eq!(&bytes[..count], b"noise");
    }
    kill_process(running.pid(), Signal::TERM).expect("it is ours");
    assert_eq!(running.end(), Some(0));
}
