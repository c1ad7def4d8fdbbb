//! The tree of InnerModel and its window for components in Python with
//! `options InnerModelViewer;`: the extension module `robocomp._innermodel`.
//!
//! It is a library of its own, because most components in Python have no tree, and should not wait
//! until this one is built.

use innermodel_viewer::innermodel::{self, Kind, Point, Pose, Time};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// The module `robocomp._innermodel`.
#[pymodule]
mod _innermodel {
    #[pymodule_export]
    use super::{Snapshot, Tree, Window};
}

/// Six numbers: x, y, z in millimetres, and the angles in radians.
type Numbers = (f64, f64, f64, f64, f64, f64);

fn pose((x, y, z, rx, ry, rz): Numbers) -> Pose {
    Pose::new(x, y, z, rx, ry, rz)
}

fn numbers(pose: &Pose) -> Numbers {
    let ([x, y, z], [rx, ry, rz]) = (pose.translation, pose.rotation);
    (x, y, z, rx, ry, rz)
}

#[expect(
    clippy::needless_pass_by_value,
    reason = "the errors of calls are mapped by this function"
)]
fn refused(error: innermodel::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A tree of InnerModel, in versions.
#[pyclass(frozen, module = "robocomp._innermodel")]
struct Tree(Arc<innermodel::InnerModel>);

#[pymethods]
impl Tree {
    /// Reads a file; without one, the tree is empty. Returns the tree, and warnings about the file.
    #[staticmethod]
    #[expect(
        clippy::needless_pass_by_value,
        reason = "a function of Python owns its arguments"
    )]
    fn read(file: PathBuf) -> PyResult<(Self, Vec<String>)> {
        let warnings = Mutex::new(Vec::new());
        let warn = |line: &str| {
            let mut warnings = warnings.lock().unwrap_or_else(PoisonError::into_inner);
            warnings.push(line.to_owned());
        };
        let tree = innermodel_viewer::parameter_tree(&file, warn).map_err(PyValueError::new_err)?;
        let warnings = warnings
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        Ok((Self(tree), warnings))
    }

    /// The present version.
    fn snapshot(&self) -> Snapshot {
        Snapshot(self.0.snapshot())
    }

    /// Sets positions of joints and poses of nodes as one new version of the time `now_ns`, or
    /// changes nothing. Returns the positions that the joints have, within their limits.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "a function of Python owns its arguments"
    )]
    fn change(
        &self,
        now_ns: u64,
        joints: Vec<(String, f64)>,
        poses: Vec<(String, Numbers)>,
    ) -> PyResult<Vec<f64>> {
        let now = Time::from_nanos(now_ns);
        let changed = self.0.change(now, |edit| {
            for (node, numbers) in poses {
                edit.set_pose(&*node, pose(numbers))?;
            }
            let set = joints.iter().map(|(node, position)| {
                Ok(match edit.set_joint(&**node, *position)? {
                    innermodel::Clamped::No => *position,
                    innermodel::Clamped::ToMin(limit) | innermodel::Clamped::ToMax(limit) => limit,
                })
            });
            set.collect()
        });
        changed.map_err(refused)
    }
}

/// A version of a tree, which never changes.
#[pyclass(frozen, module = "robocomp._innermodel")]
struct Snapshot(Arc<innermodel::Snapshot>);

#[pymethods]
impl Snapshot {
    /// The number of this version.
    #[getter]
    fn version(&self) -> u64 {
        self.0.version()
    }

    /// The ids of all nodes; the root is first.
    fn nodes(&self) -> Vec<&str> {
        self.0.nodes().map(|node| node.id()).collect()
    }

    fn __contains__(&self, node: &str) -> bool {
        self.0.node(node).is_ok()
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// The node above a node; `None` for the root.
    fn parent(&self, node: &str) -> PyResult<Option<&str>> {
        let node = self.0.node(node).map_err(refused)?;
        Ok(node.parent().map(|parent| parent.id()))
    }

    /// The nodes below a node, in their order.
    fn children(&self, node: &str) -> PyResult<Vec<&str>> {
        let node = self.0.node(node).map_err(refused)?;
        Ok(node.children().map(|child| child.id()).collect())
    }

    /// The position of a joint, in radians or millimetres; `None` for other nodes.
    fn joint(&self, node: &str) -> PyResult<Option<f64>> {
        let node = self.0.node(node).map_err(refused)?;
        let is_joint = matches!(node.kind(), Kind::Joint(_) | Kind::Prismatic(_));
        Ok(node.position().filter(|_| is_joint))
    }

    /// The pose of the frame `frame` in the frame `to`.
    fn pose(&self, to: &str, frame: &str) -> PyResult<Numbers> {
        let pose = self.0.pose(to, frame).map_err(refused)?;
        Ok(numbers(&pose))
    }

    /// A point of the frame `frame` in the frame `to`.
    fn transform(
        &self,
        to: &str,
        point: (f64, f64, f64),
        frame: &str,
    ) -> PyResult<(f64, f64, f64)> {
        let point = Point::new(point.0, point.1, point.2);
        let there = self.0.transform(to, point, frame).map_err(refused)?;
        Ok((there.x, there.y, there.z))
    }

    /// The rows of the homogeneous matrix from the frame `frame` to the frame `to`.
    fn matrix(&self, to: &str, frame: &str) -> PyResult<[[f64; 4]; 4]> {
        let matrix = self.0.matrix(to, frame).map_err(refused)?;
        Ok(std::array::from_fn(|row| {
            std::array::from_fn(|column| matrix[(row, column)])
        }))
    }
}

/// The window that shows a tree. Its lines, such as the node that its user picks, go to standard
/// error, which is the log of a component.
#[pyclass(frozen, module = "robocomp._innermodel")]
struct Window(Mutex<innermodel_viewer::Viewer>);

#[pymethods]
impl Window {
    #[new]
    fn new(title: String, tree: &Tree) -> Self {
        let name = title.clone();
        let say = move |line: &str| {
            // A closed log loses the line, and nothing else.
            let _ = writeln!(std::io::stderr(), "{name}: {line}");
        };
        let tree = Arc::clone(&tree.0);
        Self(Mutex::new(innermodel_viewer::Viewer::new(title, tree, say)))
    }

    /// Whether the display of the environment takes connections: an `OSError` says why not.
    #[staticmethod]
    fn reach(py: Python<'_>) -> PyResult<()> {
        let reached = py.detach(innermodel_viewer::reach);
        reached.map_err(|error| PyOSError::new_err(error.to_string()))
    }

    /// Opens the window, or closes it. An `OSError` says why it cannot be opened.
    fn show(&self, py: Python<'_>, wanted: bool) -> PyResult<()> {
        let shown = py.detach(|| {
            let mut window = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            window.show(wanted)
        });
        shown.map_err(|error| PyOSError::new_err(error.to_string()))
    }
}
