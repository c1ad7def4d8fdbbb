//! A disk that is filled while it is recorded: what was written is a whole recording.

use rc_record::bag::Info;
use rc_record::{Limits, Reader, Stamp, Writer};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Names the folder for [`records_until_files_are_full`].
const FOLDER: &str = "RC_FULL_FOLDER";
/// The messages of a chunk.
const MESSAGES: u64 = 3;

/// Bytes that no compression makes smaller.
fn noise(seed: u64) -> Vec<u8> {
    let mut x = seed + 1;
    let next = || {
        x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (x >> 56) as u8
    };
    std::iter::repeat_with(next).take(500).collect()
}

/// Records until the file is full. Returns the messages of whole chunks, and the error.
fn record(path: &Path) -> (u64, String) {
    let mut writer = Writer::create(path, Limits::default()).expect("to create");
    let mut written = 0;
    for chunk in 0..1000 {
        // Each chunk has another channel, and so the summary grows.
        let channel = writer.channel(&format!("/{chunk}"), "json", None, BTreeMap::new());
        for at in 0..MESSAGES {
            let stamp = Stamp {
                log_time: chunk,
                ..Stamp::default()
            };
            let done = writer.write(channel, stamp, &noise(chunk * MESSAGES + at));
            done.expect("the chunk is in memory");
        }
        // A table ends the chunk before it.
        let table = BTreeMap::from([("chunk".to_owned(), chunk.to_string())]);
        if let Err(error) = writer.metadata("m", &table) {
            // Its last bytes may be the table, or the chunk.
            let again = writer.write(channel, Stamp::default(), b"");
            assert!(
                again
                    .expect_err("it has ended")
                    .to_string()
                    .contains("has ended")
            );
            return (written, error.to_string());
        }
        written += MESSAGES;
    }
    panic!("the file is never full");
}

/// Runs in a process of its own, whose files have a limit.
#[test]
fn records_until_files_are_full() {
    let Some(folder) = std::env::var_os(FOLDER) else {
        return;
    };
    for limit in (30_000..34_000).step_by(199) {
        let limits = Rlimit {
            current: Some(limit),
            ..getrlimit(Resource::Fsize)
        };
        setrlimit(Resource::Fsize, limits).expect("to set the limit");
        let path = Path::new(&folder).join(format!("{limit}.mcap"));
        let (written, error) = record(&path);
        assert!(error.ends_with("File too large"), "{error}");
        let info = Info::read(&path).expect("a recording");
        assert!(info.faults.is_none(), "{limit}: {}", info.faults);
        assert_eq!(info.metadata["recording"]["ended"], "File too large");
        // The chunk may be whole, and its table not.
        let left = info.messages() - written;
        assert!(written > 0 && (left == 0 || left == MESSAGES), "{left}");
        let reader = Reader::open(&path).expect("a recording");
        let channels = reader.listed().expect("a summary").len() as u64;
        assert_eq!(
            (reader.times().first, channels * MESSAGES),
            (Some(0), info.messages())
        );
    }
}

#[test]
fn a_recording_on_a_full_disk_is_whole_up_to_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = Command::new(std::env::current_exe().expect("this program"))
        .args([
            "full::records_until_files_are_full",
            "--exact",
            "--nocapture",
        ])
        .env(FOLDER, folder.path())
        .output()
        .expect("to run");
    let errors = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{:?} {errors}", out.status);
    let files = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(files, 21, "it ran");
}
