//! Finds description files on the disk, in this order: the importing file's folder, every `-I`, the
//! folder `interfaces` of the workspace and those that its manifest adds, `RC_IDSL_PATH`, the
//! installed interfaces, and those that come with this program.

use crate::cargo_workspace::Workspace;
use crate::installed;
use crate::paths::{normal, relative};
use rc_diagnostics::{Diagnostic, SourceMap, Span};
use rc_files::read;
use rc_syntax::{ImportError, ImportedFile, Loader};
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The interfaces that come with this program, so that it works wherever it is installed.
const SHIPPED: [(&str, &str); 29] = [
    (
        "BatteryStatus.idsl",
        include_str!("../../components/interfaces/BatteryStatus.idsl"),
    ),
    (
        "Bumper.idsl",
        include_str!("../../components/interfaces/Bumper.idsl"),
    ),
    (
        "Camera.idsl",
        include_str!("../../components/interfaces/Camera.idsl"),
    ),
    (
        "CameraRGBDSimple.idsl",
        include_str!("../../components/interfaces/CameraRGBDSimple.idsl"),
    ),
    (
        "CameraSimple.idsl",
        include_str!("../../components/interfaces/CameraSimple.idsl"),
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
        "HumanCameraBody.idsl",
        include_str!("../../components/interfaces/HumanCameraBody.idsl"),
    ),
    (
        "IMU.idsl",
        include_str!("../../components/interfaces/IMU.idsl"),
    ),
    (
        "InnerModel.idsl",
        include_str!("../../components/interfaces/InnerModel.idsl"),
    ),
    (
        "InnerModelManager.idsl",
        include_str!("../../components/interfaces/InnerModelManager.idsl"),
    ),
    (
        "JointMotor.idsl",
        include_str!("../../components/interfaces/JointMotor.idsl"),
    ),
    (
        "Kinematics.idsl",
        include_str!("../../components/interfaces/Kinematics.idsl"),
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
        "Lidar3D.idsl",
        include_str!("../../components/interfaces/Lidar3D.idsl"),
    ),
    (
        "OmniRobot.idsl",
        include_str!("../../components/interfaces/OmniRobot.idsl"),
    ),
    (
        "RGBD.idsl",
        include_str!("../../components/interfaces/RGBD.idsl"),
    ),
    (
        "Simulation.idsl",
        include_str!("../../components/interfaces/Simulation.idsl"),
    ),
    (
        "Speech.idsl",
        include_str!("../../components/interfaces/Speech.idsl"),
    ),
    (
        "TouchSensor.idsl",
        include_str!("../../components/interfaces/TouchSensor.idsl"),
    ),
    (
        "TransformPub.idsl",
        include_str!("../../components/interfaces/TransformPub.idsl"),
    ),
    (
        "Ultrasound.idsl",
        include_str!("../../components/interfaces/Ultrasound.idsl"),
    ),
    (
        "World.idsl",
        include_str!("../../components/interfaces/World.idsl"),
    ),
    (
        "cartesian.dproto",
        include_str!("../../components/interfaces/cartesian.dproto"),
    ),
    (
        "full_pose.dproto",
        include_str!("../../components/interfaces/full_pose.dproto"),
    ),
];

/// The folder in the paths of interfaces that come with this program.
const SHIPPED_FOLDER: &str = "<shipped>";

/// The interfaces and prototypes that come with this program: names of files, and their texts.
pub fn all_shipped() -> impl Iterator<Item = (&'static str, &'static str)> {
    SHIPPED.into_iter()
}

/// Reads description files from the disk.
#[derive(Clone, Debug, Default)]
pub struct FileLoader {
    include: Vec<PathBuf>,
    path: Vec<PathBuf>,
    workspaces: RefCell<Workspaces>,
}

/// Additions by the workspaces of importing files: finding a workspace reads several manifests.
#[derive(Clone, Debug, Default)]
struct Workspaces {
    /// The folders of files, each with those that its workspace adds.
    folders: HashMap<PathBuf, Vec<PathBuf>>,
    /// The folder of the file that was asked about last.
    last: PathBuf,
}

/// The folders that the workspace of a file in `folder` adds.
fn added(folder: &Path) -> Vec<PathBuf> {
    let workspace = Workspace::of(folder).ok().flatten();
    let mut folders = workspace.map_or_else(Vec::new, |workspace| workspace.search());
    folders.retain(|dir| dir.is_dir());
    if folder.is_relative()
        && let Ok(here) = std::env::current_dir()
    {
        for dir in &mut folders {
            *dir = relative(&here, dir);
        }
    }
    folders
}

impl FileLoader {
    /// Looks into `include`, into the folders of the importing file's workspace, into those of
    /// `RC_IDSL_PATH`, and into that of installed interfaces.
    pub fn new(include: &[PathBuf]) -> Self {
        let path = std::env::var_os("RC_IDSL_PATH").unwrap_or_default();
        let there = |dir: &PathBuf| !dir.as_os_str().is_empty();
        let installed = installed::prefix().join(installed::INTERFACES);
        Self {
            include: include.iter().filter(|dir| there(dir)).cloned().collect(),
            path: std::env::split_paths(&path)
                .filter(there)
                .chain(Some(installed).filter(|folder| folder.is_dir()))
                .collect(),
            workspaces: RefCell::default(),
        }
    }

    /// The folders that the workspace of a file in `folder` adds; relative where `folder` is, so
    /// that one file has one path. A manifest that cannot be read is reported where code is
    /// generated.
    fn of_workspace(&self, folder: &Path) -> Vec<PathBuf> {
        let mut known = self.workspaces.borrow_mut();
        // Files that come with this program are imported by the file that was asked about last.
        if folder != Path::new(SHIPPED_FOLDER) {
            folder.clone_into(&mut known.last);
            if !known.folders.contains_key(folder) {
                known.folders.insert(folder.to_path_buf(), added(folder));
            }
        }
        known.folders.get(&known.last).cloned().unwrap_or_default()
    }

    /// The folders in which imports of the file `from` are looked for, in order.
    fn folders(&self, from: &Path) -> Vec<PathBuf> {
        let own = from.parent().unwrap_or(Path::new(""));
        std::iter::once(own.to_path_buf())
            .chain(self.include.iter().cloned())
            .chain(self.of_workspace(own))
            .chain(self.path.iter().cloned())
            .collect()
    }

    /// The names of all files with an ending that the file `from` can import.
    pub fn known(&self, from: &Path, ending: &str) -> Vec<String> {
        let suffix = format!(".{ending}");
        let mut known = Vec::new();
        for folder in self.folders(from) {
            let entries = std::fs::read_dir(shown(&folder));
            let entries = entries.into_iter().flatten().flatten();
            let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
            known.extend(names.filter(|name| name.ends_with(&suffix)));
        }
        let shipped = SHIPPED.iter().map(|(name, _)| (*name).to_owned());
        known.extend(shipped.filter(|name| name.ends_with(&suffix)));
        known
    }
}

fn shown(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
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
        let folders = self.folders(from);
        let places =
            std::iter::once(own.join(&wanted)).chain(folders.iter().map(|dir| dir.join(base)));
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
        // A file in the folder of interfaces searches it once.
        let mut seen = BTreeSet::new();
        let searched = folders.iter().filter(|folder| seen.insert(normal(folder)));
        let searched = searched.map(|folder| shown(folder).to_string_lossy().into_owned());
        missing.searched.extend(searched);
        missing
            .searched
            .push("the interfaces that come with rcgen".to_owned());
        missing.known = self.known(from, ending);
        Err(missing)
    }

    fn identity(&self, path: &Path) -> PathBuf {
        path.canonicalize().unwrap_or_else(|_| normal(path))
    }
}

/// The text of an interface that comes with this program, by the path that [`FileLoader`] gives it.
pub(crate) fn shipped(path: &Path) -> Option<&'static str> {
    let name = path.strip_prefix(SHIPPED_FOLDER).ok()?;
    let mut all = SHIPPED.iter();
    all.find(|(known, _)| Path::new(known) == name)
        .map(|(_, text)| *text)
}

/// The finding that a file is not text, at its first byte that is not UTF-8.
pub fn not_utf8(path: &Path, bytes: &[u8], sources: &mut SourceMap) -> Diagnostic {
    // The map of sources drops a byte order mark.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let valid = std::str::from_utf8(bytes).map_or_else(|e| e.valid_up_to(), str::len);
    let source = sources.add(path, String::from_utf8_lossy(bytes));
    // A character replaces the wrong bytes, so a span within it is not part of the text.
    let end = valid + char::REPLACEMENT_CHARACTER.len_utf8();
    let span = Span::new(source, valid, end.min(sources.text(source).len()));
    Diagnostic::error("not-utf8", span, "this file is not UTF-8")
}
