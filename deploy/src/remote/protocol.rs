//! What a supervisor and its agents say to each other: one JSON object a line, over the standard streams of ssh.
//!
//! It begins with [`SupervisorMessage::Network`], [`AgentMessage::Wants`], the bytes of the files that are wanted, one after the other, and
//! [`AgentMessage::There`]; from then on both sides speak whenever they have to say something.

use crate::client::lines::LIMIT;
use crate::process::launch::Exit;
use rc_deploy_network::plan::Component;
use serde::{Deserialize, Serialize};
use std::path::{Component as Part, Path, PathBuf};

/// The longest line, once the beginning is over: what a component may say in one, however much it has to be quoted, and
/// more.
pub(crate) const LONGEST: usize = 16 * LIMIT;

/// What the supervisor says.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SupervisorMessage {
    /// The first line.
    Network {
        /// Its name.
        name: String,
        /// What has to be there.
        files: Vec<File>,
        /// The shared-memory services that the guard there holds, as JSON.
        services: String,
    },
    /// Starts a process, with paths as they are there.
    Start {
        component: Box<Component>,
        /// Its name, and which of its runs this is.
        run: String,
        /// The first line of its link.
        greeting: Option<String>,
    },
    /// Asks one to end.
    Stop(String),
    /// Ends one, with its group.
    Kill(String),
    /// Somebody calls the management of a component; the call has this number.
    Call { wire: u64, name: String },
    /// What the caller says.
    Tell { wire: u64, text: String },
    /// The caller has gone.
    Shut(u64),
    /// The supervisor is there.
    Beat,
    /// All has ended; the agent cleans up and goes.
    Farewell,
}

/// What an agent says.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum AgentMessage {
    /// These of the files are missing there, or are not the same.
    Wants(Vec<usize>),
    /// It has all, and the network on its machine.
    There {
        /// The folder of the copies.
        root: PathBuf,
        /// How many processes of an earlier run had to be killed.
        recovered: Option<usize>,
    },
    /// It cannot do its work, and goes.
    Refused(String),
    /// A process runs.
    Started { name: String, pid: i32 },
    /// It could not be started.
    NotStarted { name: String, reason: String },
    /// A line of its link; none where it was too long.
    Said { name: String, line: Option<String> },
    /// It has closed its link.
    Closed(String),
    /// What it printed.
    Printed { name: String, text: String },
    /// What a component answers to who has called it.
    Tell { wire: u64, text: String },
    /// It answers no more, or does not answer.
    Shut(u64),
    /// It has ended, and what it left behind is gone.
    Ended {
        name: String,
        exit: Exit,
        /// How many processes that it had left behind were killed.
        left: usize,
    },
    /// Something about the agent itself that people should know.
    Note(String),
    /// The agent is there.
    Beat,
    /// Nothing is left there.
    Gone {
        /// How many processes that components had left behind were killed.
        left: usize,
    },
}

/// A file that an agent has to have.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct File {
    /// Where it is here, without `.` and `..`; there it has the same path below the folder of the copies.
    pub(crate) path: PathBuf,
    /// SHA-256 of its bytes, in hexadecimal.
    pub(crate) hash: String,
    /// Its length in bytes.
    pub(crate) size: u64,
    /// Whether it may be executed.
    pub(crate) executable: bool,
}

/// A line of the protocol.
pub(crate) fn line(message: &impl Serialize) -> Vec<u8> {
    // Names, numbers and texts can always be written; so can paths, which came from a text.
    let mut line = serde_json::to_vec(message).unwrap_or_default();
    line.push(b'\n');
    line
}

/// Where an absolute path of this machine is below `root`. What leads elsewhere stays below it all the same.
pub(crate) fn mirrored(root: &Path, path: &Path) -> PathBuf {
    let mut mirrored = PathBuf::new();
    for part in path.components() {
        match part {
            Part::Normal(name) => mirrored.push(name),
            Part::ParentDir => drop(mirrored.pop()),
            Part::Prefix(_) | Part::RootDir | Part::CurDir => {}
        }
    }
    root.join(mirrored)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_leads_out_of_the_copies() {
        let at = |path: &str| mirrored(Path::new("/cache"), Path::new(path));
        assert_eq!(at("/a/b/../c.map"), Path::new("/cache/a/c.map"));
        assert_eq!(at("/../../etc/passwd"), Path::new("/cache/etc/passwd"));
        assert_eq!(at("/"), Path::new("/cache/"));
    }
}
