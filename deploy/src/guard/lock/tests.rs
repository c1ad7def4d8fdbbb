//! The lock of a network, as other processes see it.

use super::*;
use std::sync::atomic::{AtomicU32, Ordering};

fn acquired() -> (String, Lock) {
    static NETWORKS: AtomicU32 = AtomicU32::new(0);
    let number = NETWORKS.fetch_add(1, Ordering::Relaxed);
    let network = format!("lock-{}-{number}", std::process::id());
    let lock = Lock::acquire(&network).expect("a lock");
    (network, lock)
}

/// The result of `take` once the lock is free. A process that another test starts has all
/// descriptors of this one until it runs its program, and so may hold a lock a moment longer.
fn once_free<T, E: std::fmt::Debug>(mut take: impl FnMut() -> Result<T, E>) -> T {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match take() {
            Err(_) if Instant::now() < deadline => std::thread::sleep(LOOK),
            taken => return taken.expect("it is free"),
        }
    }
}

#[test]
fn a_lock_names_its_holder() {
    let (network, lock) = acquired();
    assert!(lock.is_current() && lock.is_alone());
    let own = Identity::own().expect("it runs");
    match Lock::acquire(&network) {
        Err(Error::AlreadyUp { pid, .. }) => assert_eq!(pid, own.pid),
        other => panic!("{other:?}"),
    }
    lock.sign(Some(own)).expect("written");
    let mut file = File::open(&lock.path).expect("a file");
    let named = holders(&mut file);
    assert_eq!((named.supervisor, named.guard), (Some(own), Some(own)));
    // Those that have ended hold nothing.
    let ended = Identity {
        starttime: own.starttime + 1,
        ..own
    };
    lock.sign(Some(ended)).expect("written");
    let mut file = File::open(&lock.path).expect("a file");
    assert_eq!(holders(&mut file).guard, None);
    // The lock lasts as long as one of its holders.
    let shared = lock.share().expect("a copy");
    let directory = lock.directory().path().to_owned();
    drop(lock);
    assert!(Lock::acquire(&network).is_err());
    drop(shared);
    let lock = once_free(|| Lock::acquire(&network));
    lock.remove_directory().expect("it is ours");
    assert!(!directory.exists());
}

/// The process that runs is named, whatever became of its folder.
#[test]
fn a_network_is_locked_without_its_folder() {
    let (network, mut lock) = acquired();
    lock.directory().remove().expect("it is ours");
    let own = Identity::own().expect("it runs");
    match Lock::acquire(&network) {
        Err(Error::AlreadyUp { pid, .. }) => assert_eq!(pid, own.pid),
        other => panic!("{other:?}"),
    }
    assert!(!lock.directory().path().exists(), "a second up makes none");
    assert!(lock.restore(&network).expect("a folder"));
    assert!(lock.is_current());
    assert!(!lock.restore(&network).expect("a folder"), "it is there");
    // A guard whose supervisor is gone keeps the name, and listens nowhere.
    drop(lock.take_socket());
    once_free(|| lock.inherit_name(&network));
    assert!(matches!(take_name(&network), Ok(Name::Guard)));
    lock.remove_directory().expect("it is ours");
}

#[test]
fn a_lock_of_another_pid_namespace_is_told_at_once() {
    let (network, lock) = acquired();
    let text = r#"{"namespace":"pid:[1]","supervisor":{"pid":7,"starttime":1},"guard":null}"#;
    std::fs::write(&lock.path, text).expect("written");
    // The other namespace has an abstract socket of its own, or none.
    let error = Lock::acquire_for_agent(&network).expect_err("it is locked");
    let Error::OtherNamespace { pid, directory, .. } = &error else {
        panic!("{error:?}");
    };
    assert_eq!((*pid, &**directory), (Some(7), lock.directory().path()));
    assert!(error.to_string().contains("process 7 there"), "{error}");
    lock.remove_directory().expect("it is ours");
}

#[test]
fn a_lock_on_a_file_that_was_replaced_is_worth_nothing() {
    let (_, lock) = acquired();
    std::fs::remove_file(&lock.path).expect("a file");
    assert!(!lock.is_current());
    std::fs::write(&lock.path, "").expect("written");
    assert!(!lock.is_current());
    // The directory belongs to another network now.
    lock.remove_directory().expect("nothing to do");
    assert!(lock.directory().path().exists());
    lock.directory().remove().expect("it is ours");
}

#[test]
fn a_lock_that_cannot_be_opened_is_an_error_at_once() {
    let (network, mut lock) = acquired();
    drop(lock.take_socket());
    std::fs::remove_file(&lock.path).expect("a file");
    std::fs::create_dir(&lock.path).expect("a folder in its place");
    let begun = Instant::now();
    let error = Lock::acquire(&network)
        .expect_err("it is not a file")
        .to_string();
    assert!(error.contains(NAME), "{error}");
    assert!(begun.elapsed() < PATIENCE / 2);
    lock.directory().remove().expect("it is ours");
}

#[test]
fn the_directory_is_emptied_but_for_the_lock() {
    let (_, lock) = acquired();
    let path = lock.directory().path();
    std::fs::create_dir(path.join("folder")).expect("a folder");
    for file in ["a.sock", "folder/file"] {
        std::fs::write(path.join(file), "").expect("written");
    }
    assert!(!lock.is_alone());
    lock.empty_directory().expect("it is ours");
    assert!(lock.is_alone() && lock.is_current());
    lock.remove_directory().expect("it is ours");
}

#[test]
fn the_rest_of_an_interrupted_removal_is_removed() {
    let (network, mut lock) = acquired();
    let base = lock.directory().path().parent().expect("a folder");
    let base = base.to_owned();
    let left = [
        base.join(format!(".{network}.4711{MOVED}")),
        moved(lock.directory().path()),
    ];
    let kept = [
        base.join(format!(".{network}.x{MOVED}")),
        base.join(format!(".{network}x.4711{MOVED}")),
    ];
    for path in left.iter().chain(&kept) {
        std::fs::create_dir(path).expect("a folder");
        std::fs::write(path.join("file"), "").expect("written");
    }
    // A removal that finds the rest of another one in its way.
    lock.remove_directory().expect("it is ours");
    assert!(!lock.directory().path().exists());
    drop(lock.take_socket());
    let lock = Lock::acquire(&network).expect("a lock");
    assert!(left.iter().all(|path| !path.exists()));
    assert!(kept.iter().all(|path| path.exists()));
    lock.remove_directory().expect("it is ours");
    for path in kept {
        remove(&path).expect("it is ours");
        remove(&path).expect("it is gone already");
    }
    let file = base.join(format!(".{network}"));
    std::fs::write(&file, "").expect("written");
    assert!(remove(&file).is_err(), "it is not a folder");
    std::fs::remove_file(file).expect("it is ours");
}
