use super::*;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Stdio};

/// A file with a content, or a link to a path.
fn entry(path: &str, text: Option<&str>, to: &Path) -> (String, Entry) {
    let content = match text {
        Some(text) => Content::Bytes {
            bytes: text.into(),
            executable: false,
        },
        None => Content::Link(to.to_path_buf()),
    };
    let hash = text.map_or(LINK.to_owned(), |text| hash(text.as_bytes()));
    let path = PathBuf::from(path);
    (hash, Entry { path, content })
}

/// What a host with this home prints when it gets these files and has to build nothing.
fn round(home: &Path, list: &str, files: Vec<(String, Entry)>) -> Vec<String> {
    let lists = lists(&files);
    let entries: Vec<Entry> = files.into_iter().map(|(_, entry)| entry).collect();
    exchange(home, list, lists, entries)
}

/// What a host with this home prints when it gets these lists, and these entries.
fn exchange(home: &Path, list: &str, lists: String, entries: Vec<Entry>) -> Vec<String> {
    let mut sent = lists.into_bytes();
    archive::send(entries, &mut sent).expect("archives");
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

/// The hash of a file says nothing of its mode.
#[test]
fn a_file_that_becomes_executable_is_so_on_the_host() {
    let home = tempfile::tempdir().expect("a folder");
    let from = home.path().join("from");
    fs::write(&from, "exit 0\n").expect("written");
    let files = |executable: bool| {
        let content = Content::File {
            from: from.clone(),
            size: 7,
            executable,
        };
        let path = PathBuf::from("ws/run it");
        let other = entry("ws/lib.rs", Some("x"), Path::new(""));
        vec![(hash(b"exit 0\n"), Entry { path, content }), other]
    };
    let mode = |path: &str| {
        let path = home.path().join(".cache/robocomp/build").join(path);
        path.metadata().expect("a file").permissions().mode() & 0o777
    };
    round(home.path(), ".list-a", files(false));
    assert_eq!(mode("ws/run it"), 0o600);
    for executable in [true, true, false] {
        let said = exchange(
            home.path(),
            ".list-a",
            lists(&files(executable)),
            Vec::new(),
        );
        assert!(!said.iter().any(|line| line.starts_with("ws/")), "{said:?}");
        assert_eq!(mode("ws/run it"), if executable { 0o700 } else { 0o600 });
        assert_eq!(mode("ws/lib.rs"), 0o600);
    }
}

#[test]
fn files_have_the_paths_and_the_platform_of_the_host() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    let places = Places {
        there: PathBuf::from("/there"),
        folders: vec![root.clone()],
    };
    fs::create_dir_all(root.join("ws/.cargo")).expect("a folder");
    let here = root.join("ws");
    let (here, there) = (here.display(), places.path(&here));
    let there = there.display();
    let rewritten = |name: &str, text: &str| {
        let path = root.join("ws").join(name);
        fs::write(&path, text).expect("written");
        places.rewritten(&path).expect("a file")
    };
    let manifest = |path: &str| {
        format!(
            "[dependencies] # of this machine\na = {{ path = \"{path}\" }}\nb.path = '{path}' # literal\n\
             c = '/nowhere'\nd = [\"\"\"{path}\"\"\", 'it''s']\n"
        )
        .replace("''", "")
    };
    let text = rewritten("Cargo.toml", &manifest(&here.to_string()));
    let text: DocumentMut = text.expect("other paths").parse().expect("it is TOML");
    let wanted: DocumentMut = manifest(&there.to_string()).parse().expect("it is TOML");
    let value = |file: &DocumentMut| {
        let of = &file["dependencies"];
        ["a", "b"].map(|name| of[name]["path"].as_str().map(str::to_owned))
    };
    assert_eq!(value(&text), value(&wanted));
    assert_eq!(
        text["dependencies"]["d"].to_string(),
        format!(" [\"{there}\", 'its']")
    );
    assert!(text.to_string().contains("# of this machine"), "{text}");
    assert!(text.to_string().contains("# literal"), "{text}");

    let configuration = "[build]\ntarget = \"arm\"\njobs = 2\n";
    let text = rewritten(".cargo/config.toml", configuration);
    assert_eq!(text.as_deref(), Some("[build]\njobs = 2\n"));
    let text = rewritten(".cargo/config", "build.target = ['arm', 'arm64']\n");
    assert_eq!(text.as_deref(), Some(""));
    // A parameter of a component.
    assert_eq!(rewritten("config.toml", configuration), None);
    assert_eq!(rewritten("Cargo.toml", "no TOML"), None);
    let text = rewritten("description.rs", &format!("const A: &str = \"{here}\";\n"));
    assert_eq!(text, Some(format!("const A: &str = \"{there}\";\n")));
    assert_eq!(rewritten("notes.txt", &format!("\"{here}\"")), None);
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
    let followed_with = |printed: &str, change: fn(&mut Output)| {
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
        let mut output = Output::new(TimedStream(OwnedFd::from(ours)));
        change(&mut output);
        follow(&robot(), &greeting, &mut output)
    };
    let followed = |printed: &str| followed_with(printed, |_| ());
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

    // A host that prints for ever, with ends of lines or without, and one that only says that it works.
    for printed in ["y\n", "y"] {
        let refused = followed_with(&printed.repeat(5000), |output| output.left = 3000);
        let refused = refused.expect_err("it prints too much");
        assert!(refused.starts_with("it has printed 64 MiB"), "{refused}");
    }
    let works = format!("\n{TOKEN} works\n");
    let refused = followed_with(&works, |output| output.patience = Duration::ZERO);
    let refused = refused.expect_err("nothing is new");
    assert!(
        refused.starts_with("it has printed nothing new"),
        "{refused}"
    );
}
