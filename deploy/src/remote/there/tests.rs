use super::*;
use std::io::BufRead;
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Stdio};

/// A file with a content, or a link to a path.
fn entry(path: &str, text: Option<&str>, to: &Path) -> (String, Entry) {
    let content = match text {
        Some(text) => Content::Text(text.into()),
        None => Content::Link(to.to_path_buf()),
    };
    let hash = text.map_or(LINK.to_owned(), |text| hash(text.as_bytes()));
    let path = PathBuf::from(path);
    (hash, Entry { path, content })
}

/// What a host with this home prints when it gets these files and has to build nothing.
fn round(home: &Path, list: &str, files: Vec<(String, Entry)>) -> Vec<String> {
    let line = |(hash, entry): &(String, Entry)| format!("{hash}  {}\n", entry.path.display());
    let names: String = files.iter().map(line).collect();
    let entries: Vec<Entry> = files.into_iter().map(|(_, entry)| entry).collect();
    let mut sent = format!("{}\n{names}{}\n", names.len(), archive::size(&entries)).into_bytes();
    archive::write(&entries, &mut sent).expect("an archive");
    sent.extend(b"5\ntrue\n");
    let mut shell = Command::new("sh")
        .args(["-c", &script("own", list)])
        .env("HOME", home)
        .env_remove("XDG_CACHE_HOME")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("a shell");
    let mut input = shell.stdin.take().expect("its input");
    input.write_all(&sent).expect("it reads");
    let out = BufReader::new(shell.stdout.take().expect("its output"));
    let lines = out.lines().map(|line| line.expect("text"));
    let said = lines.filter(|line| !line.is_empty()).collect();
    assert!(shell.wait().expect("it ends").success(), "{said:?}");
    drop(input);
    said
}

#[test]
fn a_host_gets_the_sources_of_each_workspace() {
    let home = tempfile::tempdir().expect("a folder");
    let home = home.path();
    let tool = |name: &str, does: &str| {
        let path = home.join(".cargo/bin").join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(&path, format!("#!/bin/sh\n{does}\n")).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("set");
    };
    // Files are compared for longer than two pauses.
    tool("sleep", "echo >> $HOME/pauses; exec /bin/sleep 0.01");
    let waits = "n=0; until [ $n = 500 ] || [ \"$(wc -l < $HOME/pauses)\" -gt 2 ]; do n=$((n+1)); /bin/sleep 0.01; done; rm $HOME/pauses";
    let wait = format!("{waits} 2>/dev/null\nPATH=/usr/bin:/bin; exec sha256sum \"$@\"");
    tool("sha256sum", &wait);
    let sources = home.join(".cache/robocomp/build");
    let read = |path: &str| fs::read_to_string(sources.join(path)).expect("a file");
    let shared = sources.join("ws/shared");
    let linked = || {
        let files = [("ws/shared/map", Some("old")), ("ws/eye/data", None)];
        let files = files.map(|(path, text)| entry(path, text, &shared));
        let mut files = Vec::from(files);
        files.push(entry("ws/eye/one", None, &shared.join("map")));
        files.push(entry("ws/it's: FAILED $x", Some("odd"), &shared));
        round(home, ".list-a", files)
    };
    let said = linked();
    let works = |line: &&String| line.ends_with(" works");
    assert!(said.iter().filter(works).count() >= 2, "{said:?}");
    for path in ["ws/shared/map", "ws/it's: FAILED $x"] {
        assert!(said.contains(&path.to_owned()), "{said:?}");
    }
    assert_eq!(read("ws/eye/data/map"), "old");

    // A folder is in the place of the link, with a file that the link has, too.
    let files = [
        ("ws/shared/map", "old"),
        ("ws/eye/data/map", "new"),
        ("ws/eye/one", "old"),
        ("ws/eye/data/deep/er/map", "new"),
    ];
    let files = files.map(|(path, text)| entry(path, Some(text), &shared));
    round(home, ".list-a", files.into());
    assert_eq!(
        (read("ws/shared/map"), read("ws/eye/data/map")),
        ("old".into(), "new".into())
    );

    // A file with the content that the link had is no link.
    assert!(!sources.join("ws/eye/one").is_symlink());

    // And the links are back.
    linked();
    assert_eq!(read("ws/eye/data/map"), "old");

    // Another workspace leaves the files of this one alone; the last build of its own does not.
    round(
        home,
        ".list-b",
        vec![entry("other/lib.rs", Some("x"), &shared)],
    );
    assert_eq!(
        (read("ws/shared/map"), read("other/lib.rs")),
        ("old".into(), "x".into())
    );
    round(
        home,
        ".list-b",
        vec![entry("other/main.rs", Some("x"), &shared)],
    );
    assert!(!sources.join("other/lib.rs").exists());
}

fn robot() -> Host {
    Host {
        name: "robot".to_owned(),
        address: "10.0.0.2".to_owned(),
        user: None,
        workspace: None,
        elsewhere: None,
    }
}

#[test]
fn a_host_needs_a_cargo_that_knows_the_packages() {
    let sources = Sources {
        folders: Vec::new(),
        files: Vec::new(),
        rust: Some((1, 90)),
    };
    let check = |cargo: &str| check_cargo(&robot(), cargo, &sources);
    let refused = check("").expect_err("there is none");
    assert!(refused.contains("it has no cargo; "), "{refused}");
    assert!(
        refused.contains("`ssh 10.0.0.2 cargo --version`"),
        "{refused}"
    );
    let refused = check("cargo 1.89.2 (d1fd9fe2c 2022-03-01)").expect_err("it is old");
    let advice = "its cargo 1.89.2 is too old: the packages need Rust 1.90; `ssh 10.0.0.2 rustup update stable`";
    assert!(refused.starts_with(advice), "{refused}");
    for good in ["cargo 1.90.0 (x)", "cargo 2.0.0", "cargo of a friend"] {
        assert_eq!(check(good), Ok(()));
    }
}

#[test]
fn a_build_that_fails_says_what_the_host_lacks() {
    let followed = |printed: &str| {
        let (ours, mut theirs) = UnixStream::pair().expect("a pair");
        ours.set_nonblocking(true).expect("a mode");
        theirs.write_all(printed.as_bytes()).expect("room");
        drop(theirs);
        let greeting = Greeting {
            folder: PathBuf::from("/cache/build"),
            cargo: String::new(),
            free: "12000".to_owned(),
            has_rcdeploy: false,
        };
        let mut input = BufReader::new(TimedStream(OwnedFd::from(ours)));
        follow(&robot(), &greeting, &mut input)
    };
    let ended = |said: &str, code: u8| {
        followed(&format!(
            "{said}\n\n{TOKEN} works\n\n{TOKEN} ended {code}\n"
        ))
    };
    assert_eq!(ended("warning: unused", 0), Ok(()));
    let failed = |said: &str| ended(said, 101).expect_err("it fails");
    let full = failed("error: failed to write x.rmeta: No space left on device (os error 28)");
    assert!(
        full.starts_with("its disk is full (12 MB were free before); "),
        "{full}"
    );
    assert!(full.contains("is kept in /cache/build, "), "{full}");
    assert!(failed("error: linker `cc` not found").starts_with("it has no C compiler; "));
    assert!(failed("error: failed to download").starts_with("it cannot download "));
    assert_eq!(failed("error[E0308]"), "cargo failed there (exit code 101)");
    assert_eq!(followed("   Compiling x\n"), Err(LOST.to_owned()));
}
