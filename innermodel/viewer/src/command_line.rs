//! The command line of `rcview`.

use innermodel::Point;
use innermodel_viewer::{Marks, Viewpoint};
use lexopt::{Arg, Parser, ValueExt};
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

/// Text of `--help`.
const HELP: &str = "\
Shows or edits an InnerModel file in a window, or draws it into a file

Usage: rcview [OPTIONS] FILE.xml
       rcview --live [NETWORK] [--simulator NAME] [--png FILE] [--camera CAMERA] [--size WxH]
       rcview --world [NETWORK] [--png FILE] [--camera CAMERA] [--size WxH] [-I DIR]

Options:
      --camera <CAMERA>    The id of a camera or rgbd of the file, or a point X,Y,Z in millimetres that looks
                           at the middle of the scene, or six numbers: a point and another one to look at
      --png <FILE>         Draws into a file, without a window
      --size <WxH>         The size of the image or the window in pixels [default: that of the camera for an
                           image, otherwise 960x640]
      --ids                Gives each node a colour of its own in the image, and prints the colours
      --live               Shows the world of the simulator of a running network, which draws the pictures;
                           the network needs a name only if several run
      --simulator <NAME>   The component whose world --live shows, if the network has several simulators
      --world              Shows the frames and bodies of the world that the components of a running network
                           share; the network needs a name only if several run
      --edit               Opens an editor: select, move, turn, add and remove nodes; h lists the keys
      --slots              Prints the members of slot arrays that a simulator of the file has, as a .ddsl
                           lists them
      --frames             Draws the axes of frames: x red, y green, z blue
      --names              Writes the ids of nodes
      --joint <ID=VALUE>   Moves a joint: an angle in radians, or millimetres of a prismatic one
      --points <ID=FILE>   Fills a pointcloud: each line of the file has X Y Z in millimetres, in the frame of
                           the node, and may have red, green and blue from 0 to 255
  -I <DIR>                 Looks for meshes and included files here, too
  -h, --help               Prints this help
  -V, --version            Prints the version

In the window: drag to turn, drag with the right button to move, the wheel zooms, a click picks a node and
prints its pose, p picks the node above; f switches frames, n names, r returns to the first view, q ends.

Exit codes: 0 success, 1 the file is wrong, 2 the command line is wrong, 3 the system refused something
";

/// Error that ends the program.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The file is wrong.
    Input(String),
    /// The command line is wrong.
    Usage(String),
    /// The system refused something.
    System(String),
}

impl Failure {
    pub(crate) fn text(&self) -> &str {
        match self {
            Self::Input(text) | Self::Usage(text) | Self::System(text) => text,
        }
    }

    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Input(_) => 1,
            Self::Usage(_) => 2,
            Self::System(_) => 3,
        }
    }
}

impl From<lexopt::Error> for Failure {
    fn from(error: lexopt::Error) -> Self {
        Self::Usage(error.to_string())
    }
}

/// Request of the user.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Request {
    pub(crate) file: PathBuf,
    pub(crate) include: Vec<PathBuf>,
    pub(crate) camera: Viewpoint,
    pub(crate) png: Option<PathBuf>,
    pub(crate) size: Option<(usize, usize)>,
    pub(crate) ids: bool,
    pub(crate) edit: bool,
    pub(crate) slots: bool,
    pub(crate) marks: Marks,
    pub(crate) joints: Vec<(String, f64)>,
    pub(crate) points: Vec<(String, PathBuf)>,
}

/// Pictures of a running network: in a window, or one in a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Live {
    pub(crate) network: Option<OsString>,
    pub(crate) simulator: Option<String>,
    pub(crate) png: Option<PathBuf>,
    pub(crate) camera: Viewpoint,
    pub(crate) size: Option<(usize, usize)>,
}

/// Request of the command line.
pub(crate) enum Command {
    /// Prints a text.
    Print(&'static str),
    /// Shows or draws a file.
    View(Request),
    /// Opens an editor.
    Edit(Request),
    /// Shows the world of a running network's simulator.
    Live(Live),
    /// Shows the world that components of a running network share.
    World(Option<OsString>, Request),
}

/// Reads the command line.
pub(crate) fn parse(mut parser: Parser) -> Result<Command, Failure> {
    let (mut is_live, mut is_world, mut network, mut simulator) = (false, false, None, None);
    let mut values = Vec::new();
    let mut request = Request {
        file: PathBuf::new(),
        include: Vec::new(),
        camera: Viewpoint::Whole,
        png: None,
        size: None,
        ids: false,
        edit: false,
        slots: false,
        marks: Marks::default(),
        joints: Vec::new(),
        points: Vec::new(),
    };
    while let Some(argument) = parser.next()? {
        match argument {
            Arg::Short('h') | Arg::Long("help") => return Ok(Command::Print(HELP)),
            Arg::Short('V') | Arg::Long("version") => {
                let version = concat!("rcview ", env!("CARGO_PKG_VERSION"), "\n");
                return Ok(Command::Print(version));
            }
            Arg::Short('I') => request.include.push(parser.value()?.into()),
            Arg::Long("camera") => request.camera = camera(parser.value()?.string()?),
            Arg::Long("png") => request.png = Some(parser.value()?.into()),
            Arg::Long("size") => {
                let text = parser.value()?.string()?;
                let wrong =
                    || format!("`--size {text}`: expected a width and a height, as in 640x480");
                request.size = Some(size(&text).ok_or_else(|| Failure::Usage(wrong()))?);
            }
            Arg::Long("ids") => request.ids = true,
            Arg::Long("live") => {
                is_live = true;
                network = parser.optional_value();
            }
            Arg::Long("world") => {
                is_world = true;
                network = parser.optional_value();
            }
            Arg::Long("simulator") => simulator = Some(parser.value()?.string()?),
            Arg::Long("edit") => request.edit = true,
            Arg::Long("slots") => request.slots = true,
            Arg::Long("frames") => request.marks.frames = true,
            Arg::Long("names") => request.marks.names = true,
            Arg::Long("joint") => {
                let text = parser.value()?.string()?;
                let joint = text
                    .rsplit_once('=')
                    .and_then(|(id, value)| Some((id.to_owned(), value.parse().ok()?)));
                request.joints.push(joint.ok_or_else(|| {
                    let text =
                        format!("`--joint {text}`: expected an id and a number, as in arm=0.5");
                    Failure::Usage(text)
                })?);
            }
            Arg::Long("points") => {
                let text = parser.value()?.string()?;
                let cloud = text.split_once('=');
                let cloud = cloud.map(|(id, file)| (id.to_owned(), PathBuf::from(file)));
                request.points.push(cloud.ok_or_else(|| {
                    let text = format!(
                        "`--points {text}`: expected an id and a file, as in seen=seen.xyz"
                    );
                    Failure::Usage(text)
                })?);
            }
            Arg::Value(value) => values.push(value),
            other => return Err(other.unexpected().into()),
        }
    }
    if is_live && is_world {
        let text = "`--live` cannot be used with `--world`".to_owned();
        return Err(Failure::Usage(text));
    }
    if (is_live || is_world)
        && network.is_none()
        && values.first().is_some_and(|value| is_network(value))
    {
        // The network is an argument like the file.
        network = Some(values.remove(0));
    }
    if is_world {
        return world(network, simulator.is_some(), !values.is_empty(), request);
    }
    if is_live {
        return live(network, simulator, !values.is_empty(), request);
    }
    if simulator.is_some() {
        let text = "`--simulator` needs `--live`".to_owned();
        return Err(Failure::Usage(text));
    }
    let mut values = values.into_iter();
    let missing = || Failure::Usage("expected a file, as in `rcview world.xml`".to_owned());
    request.file = values.next().ok_or_else(missing)?.into();
    if let Some(other) = values.next() {
        return Err(Arg::Value(other).unexpected().into());
    }
    if request.ids && request.png.is_none() {
        let text = "`--ids` needs `--png FILE`".to_owned();
        return Err(Failure::Usage(text));
    }
    if request.edit {
        let other = [
            ("--png", request.png.is_some()),
            ("--slots", request.slots),
            ("--joint", !request.joints.is_empty()),
            ("--points", !request.points.is_empty()),
        ];
        if let Some((name, _)) = other.into_iter().find(|(_, is_there)| *is_there) {
            let text = format!("`--edit` cannot be used with `{name}`");
            return Err(Failure::Usage(text));
        }
        return Ok(Command::Edit(request));
    }
    Ok(Command::View(request))
}

/// Whether an argument may be a network: its name or its .ddsl.
fn is_network(value: &OsStr) -> bool {
    let ending = Path::new(value).extension();
    ending.is_none_or(|ending| ending == "ddsl")
}

/// A request for pictures of a running network, which has nothing to do with a file.
fn live(
    network: Option<OsString>,
    simulator: Option<String>,
    has_file: bool,
    request: Request,
) -> Result<Command, Failure> {
    let other = [
        ("a file", has_file),
        ("`--edit`", request.edit),
        ("`--slots`", request.slots),
        ("`--ids`", request.ids),
        ("`--frames`", request.marks.frames),
        ("`--names`", request.marks.names),
        ("`--joint`", !request.joints.is_empty()),
        ("`--points`", !request.points.is_empty()),
        ("`-I`", !request.include.is_empty()),
    ];
    if let Some((name, _)) = other.into_iter().find(|(_, is_there)| *is_there) {
        let text = format!("`--live` cannot be used with {name}");
        return Err(Failure::Usage(text));
    }
    Ok(Command::Live(Live {
        network,
        simulator,
        png: request.png,
        camera: request.camera,
        size: request.size,
    }))
}

/// A request for the world of a running network, whose tree has no file.
fn world(
    network: Option<OsString>,
    has_simulator: bool,
    has_file: bool,
    mut request: Request,
) -> Result<Command, Failure> {
    let other = [
        ("a file", has_file),
        ("`--simulator`", has_simulator),
        ("`--edit`", request.edit),
        ("`--slots`", request.slots),
        ("`--joint`", !request.joints.is_empty()),
        ("`--points`", !request.points.is_empty()),
    ];
    if let Some((name, _)) = other.into_iter().find(|(_, is_there)| *is_there) {
        let text = format!("`--world` cannot be used with {name}");
        return Err(Failure::Usage(text));
    }
    if request.ids && request.png.is_none() {
        let text = "`--ids` needs `--png FILE`".to_owned();
        return Err(Failure::Usage(text));
    }
    // Most nodes of a world are frames, of which nothing else is seen.
    (request.marks.frames, request.marks.names) = (true, true);
    Ok(Command::World(network, request))
}

/// Three or six finite numbers are points; anything else is an id.
fn camera(text: String) -> Viewpoint {
    let number = |word: &str| word.trim().parse().ok().filter(|n: &f64| n.is_finite());
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    let Some(numbers) = numbers else {
        return Viewpoint::Camera(text);
    };
    let (points, rest) = numbers.as_chunks::<3>();
    match (points, rest) {
        ([from], []) => Viewpoint::Point(Point::from(*from), None),
        ([from, to], []) => Viewpoint::Point(Point::from(*from), Some(Point::from(*to))),
        _ => Viewpoint::Camera(text),
    }
}

fn size(text: &str) -> Option<(usize, usize)> {
    let (width, height) = text.split_once('x')?;
    let size = (width.parse().ok()?, height.parse().ok()?);
    (size.0 > 0 && size.1 > 0).then_some(size)
}
