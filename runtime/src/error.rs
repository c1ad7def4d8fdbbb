//! Why a component does not start, and why the configuration checker refuses a change.

use crate::worker_error::WorkerError;
use rc_diagnostics::foreign::without_number;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_management::rpc::{Error, ErrorData, Finding};
use rc_middleware::OpenError;

/// Why a component did not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The command line is wrong.
    #[error("{0}")]
    Usage(String),
    /// The configuration is wrong; the text is one or more diagnostics.
    #[error("{0}")]
    Configuration(String),
    /// A connection could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The worker's `initialize` failed.
    #[error("initialize(): {0}")]
    Worker(String),
    /// The system refused.
    #[error("{0}")]
    System(String),
}

impl StartError {
    /// The exit code of the process.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Configuration(_) => 1,
            Self::Usage(_) => 2,
            Self::Open(_) | Self::Worker(_) | Self::System(_) => 3,
        }
    }

    /// The message that a component of this name prints at its end.
    pub(crate) fn report_line(&self, name: &str) -> String {
        match self {
            Self::Configuration(text) => text.clone(),
            Self::Usage(_) | Self::Open(_) | Self::Worker(_) | Self::System(_) => {
                let text = self.to_string();
                format!("{name}: error: {}\n", without_number(&text))
            }
        }
    }

    /// The system refused to create something.
    pub(crate) fn cannot_create(what: &str, error: &std::io::Error) -> Self {
        Self::System(format!("cannot create {what}: {error}"))
    }
}

impl From<WorkerError> for StartError {
    fn from(error: WorkerError) -> Self {
        let (WorkerError::Failed(reason)
        | WorkerError::Emergency(reason)
        | WorkerError::Fatal(reason)) = error;
        Self::Worker(reason)
    }
}

/// The findings of the configuration checker as the answer to a request.
pub(crate) fn refused(found: &Diagnostics) -> Error {
    let line = |finding: &Diagnostic| match &finding.help {
        Some(help) => format!("{} ({help})", finding.message),
        None => finding.message.clone(),
    };
    let lines: Vec<String> = found.iter().map(line).collect();
    let findings = found.iter().map(|finding| Finding {
        code: finding.code.to_string(),
        help: finding.help.clone(),
        message: finding.message.clone(),
    });
    Error {
        data: Some(ErrorData {
            findings: findings.collect(),
        }),
        ..Error::new(Error::INVALID_PARAMS, lines.join("; "))
    }
}
