//! Finds description files on the disk, in this order: the importing file's folder, every `-I`, the
//! folder `interfaces` of the workspace, `RC_IDSL_PATH`, and the interfaces that come with this
//! program.

use crate::cargo_workspace::{self, Workspace};
use rc_diagnostics::{Diagnostic, SourceMap, Span};
pub use rc_files::read;
use rc_syntax::{ImportError, ImportedFile, Loader};
use std::cell::RefCell;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The interfaces that come with this program, so that it works wherever it is installed.
const SHIPPED: [(&str, &str); 10] = [
    (
        "Camera.idsl",
        include_str!("../../components/interfaces/Camera.idsl"),
    ),
    (
        "CommonBehavior.idsl",
        include_str!("../../components/interfaces/CommonBehavior.idsl"),
    ),
    (
        "DifferentialRobot.idsl",
        include_str!("../../components/interfaces/DifferentialRobot.idsl"),
    ),
    (
        "FullPoseEstimation.idsl",
        include_str!("../../components/interfaces/FullPoseEstimation.idsl"),
    ),
    (
        "FullPoseEstimationPub.idsl",
        include_str!("../../components/interfaces/FullPoseEstimationPub.idsl"),
    ),
    (
        "GenericBase.idsl",
        include_str!("../../components/interfaces/GenericBase.idsl"),
    ),
    (
        "JointMotor.idsl",
        include_str!("../../components/interfaces/JointMotor.idsl"),
    ),
    (
        "Laser.idsl",
        include_str!("../../components/interfaces/Laser.idsl"),
    ),
    (
        "LaserPub.idsl",
        include_str!("../../components/interfaces/LaserPub.idsl"),
    ),
    (
        "Speech.idsl",
        include_str!("../../components/interfaces/Speech.idsl"),
    ),
];

/// The folder in the paths of interfaces that come with this program.
const SHIPPED_FOLDER: &str = "<shipped>";

/// Reads description files from the disk.
#[derive(Clone, Debug, Default)]
pub struct FileLoader {
    include: Vec<PathBuf>,
    path: Vec<PathBuf>,
    /// The folder of the file that was asked about last, and the interfaces of its workspace.
    workspace: RefCell<Option<(PathBuf, Option<PathBuf>)>>,
}

impl FileLoader {
    /// Looks into `include`, into the folder `interfaces` of the importing file's workspace, and
    /// into the folders of `RC_IDSL_PATH`.
    pub fn new(include: &[PathBuf]) -> Self {
        let path = std::env::var_os("RC_IDSL_PATH").unwrap_or_default();
        let there = |dir: &PathBuf| !dir.as_os_str().is_empty();
        Self {
            include: include.iter().filter(|dir| there(dir)).cloned().collect(),
            path: std::env::split_paths(&path).filter(there).collect(),
            workspace: RefCell::default(),
        }
    }

    /// The folder of interfaces of the workspace of a file in `folder`; relative where `folder` is,
    /// so that one file has one path. A manifest that cannot be read is reported where code is
    /// generated.
    fn interfaces(&self, folder: &Path) -> Option<PathBuf> {
        let mut last = self.workspace.borrow_mut();
        // Files that come with this program are imported by the file that was asked about last.
        if folder != Path::new(SHIPPED_FOLDER)
            && last.as_ref().is_none_or(|(known, _)| known != folder)
        {
            let workspace = Workspace::of(folder).ok().flatten();
            let interfaces = workspace.map(|workspace| workspace.interfaces());
            let interfaces = interfaces.filter(|dir| dir.is_dir());
            let here = std::env::current_dir().ok();
            let interfaces = match (interfaces, here) {
                (Some(dir), Some(here)) if folder.is_relative() => {
                    Some(cargo_workspace::relative(&here, &dir))
                }
                (interfaces, _) => interfaces,
            };
            *last = Some((folder.to_path_buf(), interfaces));
        }
        last.as_ref().and_then(|(_, interfaces)| interfaces.clone())
    }
}

impl Loader for FileLoader {
    fn find(&self, from: &Path, wanted: &str, ending: &str) -> Result<ImportedFile, ImportError> {
        let suffix = format!(".{ending}");
        let wanted = if wanted.ends_with(&suffix) {
            wanted.to_owned()
        } else {
            format!("{wanted}{suffix}")
        };
        let base = wanted.rsplit(['/', '\\']).next().unwrap_or(&wanted);
        let own = from.parent().unwrap_or(Path::new(""));
        let mut missing = ImportError::default();
        // The path as written, then its base name in every folder.
        let folders = std::iter::once(own.to_path_buf())
            .chain(self.include.iter().cloned())
            .chain(self.interfaces(own))
            .chain(self.path.iter().cloned());
        let places =
            std::iter::once(own.join(&wanted)).chain(folders.clone().map(|dir| dir.join(base)));
        for place in places {
            match read(&place) {
                Ok(text) => {
                    return Ok(ImportedFile {
                        path: normal(&place),
                        text,
                    });
                }
                Err(error)
                    if error.kind() == ErrorKind::NotFound
                        || error.kind() == ErrorKind::NotADirectory => {}
                Err(error) => {
                    missing.refused = Some(format!("{}: {error}", place.display()));
                    return Err(missing);
                }
            }
        }
        if let Some((name, text)) = SHIPPED.iter().find(|(name, _)| *name == base) {
            return Ok(ImportedFile {
                path: Path::new(SHIPPED_FOLDER).join(name),
                text: (*text).to_owned(),
            });
        }
        for folder in folders {
            let shown = if folder.as_os_str().is_empty() {
                "."
            } else {
                &folder.to_string_lossy()
            };
            missing.searched.push(shown.to_owned());
            let entries = std::fs::read_dir(shown).into_iter().flatten().flatten();
            let names = entries.filter_map(|e| e.file_name().into_string().ok());
            missing
                .known
                .extend(names.filter(|name| name.ends_with(&suffix)));
        }
        missing
            .searched
            .push("the interfaces that come with rcgen".to_owned());
        missing
            .known
            .extend(SHIPPED.iter().map(|(name, _)| (*name).to_owned()));
        Err(missing)
    }
}

/// The text of an interface that comes with this program, by the path that [`FileLoader`] gives it.
pub(crate) fn shipped(path: &Path) -> Option<&'static str> {
    let name = path.strip_prefix(SHIPPED_FOLDER).ok()?;
    let mut all = SHIPPED.iter();
    all.find(|(known, _)| Path::new(known) == name)
        .map(|(_, text)| *text)
}

/// An error with the path that it is about.
pub(crate) fn named(path: &Path, error: &std::io::Error) -> std::io::Error {
    std::io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

/// The finding that a file is no text, at its first byte that is not UTF-8.
pub fn not_utf8(path: &Path, bytes: &[u8], sources: &mut SourceMap) -> Diagnostic {
    let valid = std::str::from_utf8(bytes).map_or_else(|e| e.valid_up_to(), str::len);
    let source = sources.add(path, String::from_utf8_lossy(bytes));
    let span = Span::new(source, valid, valid + 1);
    Diagnostic::error("not-utf8", span, "this file is not UTF-8")
}

/// `a/./b/../c` as `a/c`, so that one file has one path; links are left alone.
pub(crate) fn normal(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(out.components().next_back(), Some(Component::Normal(_))) =>
            {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}
