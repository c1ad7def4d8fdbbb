//! A chain of joints, for both libraries.

use innermodel::InnerModel;
use innermodel::language::{Document, print};
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

/// A chain of joints about x, y and z in turns.
pub(crate) struct Chain {
    links: usize,
}

impl Chain {
    pub(crate) fn new(links: usize) -> Self {
        Self { links }
    }

    /// The text of a file.
    pub(crate) fn text(&self) -> String {
        let mut text = String::from("<innerModel>");
        for n in 0..self.links {
            let axis = ["x", "y", "z"][n % 3];
            write!(text, r#"<joint id="j{n}" axis="{axis}" tx="10" ty="20" tz="30" rx="0.1" min="-3" max="3">"#)
                .expect("a text");
        }
        text.push_str(r#"<transform id="tip" tz="5"/>"#);
        text.push_str(&"</joint>".repeat(self.links));
        text.push_str("</innerModel>");
        text
    }

    pub(crate) fn document(&self) -> Document {
        let read = innermodel::read_text(&self.text(), Path::new("chain.xml"), &Default::default());
        read.expect("a chain").0
    }

    pub(crate) fn tree(&self) -> InnerModel {
        InnerModel::from_document(&self.document()).expect("a tree")
    }

    /// The chain as URDF.
    pub(crate) fn urdf_text(&self) -> String {
        innermodel_exchange::urdf::write(&self.document(), "chain").0
    }

    pub(crate) fn urdf(&self) -> urdf_rs::Robot {
        urdf_rs::read_from_string(&self.urdf_text()).expect("a robot")
    }

    /// A tree of many parallel joints.
    pub(crate) fn flat(nodes: usize) -> InnerModel {
        let mut text = String::from("<innerModel>");
        for n in 0..nodes {
            write!(text, r#"<joint id="j{n}" tx="{n}"/>"#).expect("a text");
        }
        text.push_str("</innerModel>");
        InnerModel::parse(&text).expect("a tree")
    }
}

/// The time to load a chain of 300 nodes from the disk, in ns: ours, and that of `urdf-rs` with
/// `k`.
pub(crate) fn load() -> (f64, f64) {
    let folder = std::env::temp_dir().join(format!("bench_innermodel_{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let chain = Chain::new(299);
    let (xml, urdf) = (folder.join("chain.xml"), folder.join("chain.urdf"));
    std::fs::write(&xml, print(&chain.document())).expect("a file");
    std::fs::write(&urdf, chain.urdf_text()).expect("a file");
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for _ in 0..41 {
        let start = Instant::now();
        assert_eq!(crate::read(&xml).snapshot().len(), 301);
        a.push(start.elapsed().as_nanos() as f64);
        let start = Instant::now();
        let robot = urdf_rs::read_file(&urdf).expect("a robot");
        let robot: k::Chain<f64> = (&robot).into();
        assert_eq!(robot.dof(), 299);
        b.push(start.elapsed().as_nanos() as f64);
    }
    let _ = std::fs::remove_dir_all(&folder);
    (crate::median(a), crate::median(b))
}

/// Writes the chains and the mesh for the programs in Python.
pub(crate) fn write(folder: &Path) {
    for links in [7, 30] {
        let path = folder.join(format!("chain{links}.urdf"));
        std::fs::write(path, Chain::new(links).urdf_text()).expect("a file");
    }
    std::fs::write(folder.join("ball.obj"), crate::rays::ball()).expect("a file");
}
