//! Wavefront OBJ: its vertices and faces, and with `Looks` the colours and pictures of its
//! materials. Normals and curves are not used.

use crate::clipping::Clipping;
use crate::looks::{AlphaMode, Look, Looks, MOST_MATERIALS, Material, Picture, Wrap, colour, find};
use crate::{MeshError, TriangleMesh};
use rc_diagnostics::foreign::clean;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

/// The largest library of materials that is read, in bytes.
const LARGEST_LIBRARY: u64 = 16 << 20;
/// How many libraries of materials a mesh may name.
const MOST_LIBRARIES: usize = 64;

/// Reads the triangles. `looks` gets how they look; its files are looked for in the folder.
pub(crate) fn read(
    bytes: &[u8],
    looks: Option<(&Path, &mut Looks)>,
) -> Result<TriangleMesh, MeshError> {
    let text = String::from_utf8_lossy(bytes);
    let mut mesh = TriangleMesh::default();
    let mut painter = looks.map(|(folder, looks)| Painter::new(folder, looks));
    // A mark of the encoding would hide the first vertex.
    let text = text.trim_start_matches('\u{feff}');
    let mut clipping = Clipping::default();
    let mut short = None;
    for (number, line) in lines(text) {
        short = None;
        let line = line.as_ref();
        let wrong = |what: &str| MeshError::Wrong(format!("line {number}: {what}"));
        let mut words = match line.trim_start().as_bytes() {
            // Names may have the sign of a comment.
            [b'v' | b'f', ..] => without_comment(line),
            _ => line,
        }
        .split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.take(3).map_while(|w| w.parse().ok()).collect();
                let vertex = numbers.try_into();
                mesh.vertices
                    .push(vertex.map_err(|_| wrong("expected three numbers"))?);
            }
            // The older name of a face.
            Some("f" | "fo") => {
                let count = mesh.vertices.len();
                let corner = |word: &str| {
                    let at = word.split('/').next()?.parse::<i64>().ok()?;
                    u32::try_from(place(at, count)?).ok()
                };
                let corners: Option<Vec<u32>> = words.clone().map(corner).collect();
                let corners = corners.ok_or_else(|| wrong("expected places of vertices"))?;
                // Such a face has no area, unless the file is cut in it.
                short = (corners.len() < 3).then_some(number);
                let triangles = clipping.triangles(&mesh.vertices, &corners);
                let triangles = triangles.map_err(&wrong)?;
                let places = triangles.iter();
                let places = places.map(|three| three.map(|place| corners[place]));
                mesh.triangles.extend(places);
                if let Some(painter) = &mut painter {
                    painter.face(words, &triangles);
                }
            }
            Some("surf" | "call" | "bsp" | "bzp") => {
                return Err(wrong("curved surfaces and other files are not read"));
            }
            Some(word) => {
                if let Some(painter) = &mut painter {
                    painter.other(word, line.trim_start()[word.len()..].trim());
                }
            }
            None => {}
        }
    }
    match short.filter(|_| !text.ends_with(['\n', '\r'])) {
        Some(number) => Err(MeshError::Wrong(format!(
            "line {number}: the file is cut: a face has three corners or more"
        ))),
        None => Ok(mesh),
    }
}

/// The lines of a text with their numbers. A line that ends with `\\` continues in the next one,
/// unless it is a comment or a name, which may be a path of Windows.
fn lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let mut rest = (1..).zip(text.split(end));
    std::iter::from_fn(move || {
        let (number, line) = rest.next()?;
        let mut line = Cow::Borrowed(line);
        while let Some(begun) = line.trim_end().strip_suffix('\\')
            && !is_text(begun)
        {
            let begun = begun.len();
            let whole = line.to_mut();
            whole.truncate(begun);
            whole.push(' ');
            match rest.next() {
                Some((_, more)) => whole.push_str(more),
                None => break,
            }
        }
        Some((number, line))
    })
}

/// Whether the end of a line belongs to a comment or to a name.
fn is_text(line: &str) -> bool {
    match line.split_whitespace().next() {
        Some("v" | "vt" | "vn" | "f" | "fo") => line.contains('#'),
        Some(word) => {
            word.starts_with('#') || matches!(word, "g" | "o" | "usemtl" | "newmtl" | "mtllib")
        }
        None => false,
    }
}

/// The part before a comment.
fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default()
}

/// The index of a place: from 1, or counted back from the last of `count`.
fn place(at: i64, count: usize) -> Option<usize> {
    let count = i64::try_from(count).ok()?;
    let at = if at < 0 { count + at } else { at - 1 };
    usize::try_from(at).ok()
}

/// The appearance of the following faces.
struct Painter<'p> {
    folder: &'p Path,
    looks: &'p mut Looks,
    /// The places of materials by their names, and where their pictures are on a surface.
    names: HashMap<String, (u32, Mapping)>,
    libraries: usize,
    /// Places in pictures: to the right and upwards.
    places: Vec<[f32; 2]>,
    current: Option<(u32, Mapping)>,
}

/// Places in a picture are multiplied by the first numbers, and moved by the second ones.
#[derive(Clone, Copy)]
struct Mapping {
    scale: [f32; 2],
    offset: [f32; 2],
}

const PLAIN: Mapping = Mapping {
    scale: [1.0; 2],
    offset: [0.0; 2],
};

impl<'p> Painter<'p> {
    fn new(folder: &'p Path, looks: &'p mut Looks) -> Self {
        Self {
            folder,
            looks,
            names: HashMap::new(),
            libraries: 0,
            places: Vec::new(),
            current: None,
        }
    }

    /// A line that is neither a vertex nor a face.
    fn other(&mut self, word: &str, rest: &str) {
        match word {
            "vt" => {
                let mut numbers = rest.split_whitespace().map(str::parse::<f32>);
                let mut next = || {
                    numbers
                        .next()
                        .and_then(Result::ok)
                        .filter(|n| n.is_finite())
                };
                let (u, v) = (next().unwrap_or(0.0), next().unwrap_or(0.0));
                self.places.push([u, v]);
            }
            "usemtl" => {
                let found = self.names.get(rest);
                let found = found.or_else(|| self.names.get(without_comment(rest).trim_end()));
                self.current = found.copied();
            }
            "mtllib" if find(self.folder, rest).exists() => self.library(rest),
            "mtllib" => self.library(without_comment(rest).trim_end()),
            _ => {}
        }
    }

    /// A face with the triangles that it became.
    fn face<'w>(&mut self, words: impl Iterator<Item = &'w str>, triangles: &[[usize; 3]]) {
        let (material, mapping) = match self.current {
            Some((material, mapping)) => (Some(material), mapping),
            None => (None, PLAIN),
        };
        let corner = |word: &str| {
            let at = word.split('/').nth(1)?.parse().ok()?;
            let [u, v] = *self.places.get(place(at, self.places.len())?)?;
            let u = u * mapping.scale[0] + mapping.offset[0];
            // Files count upwards.
            let v = 1.0 - (v * mapping.scale[1] + mapping.offset[1]);
            (u.is_finite() && v.is_finite()).then_some([u, v])
        };
        let corners: Vec<[f32; 2]> = words.map(|word| corner(word).unwrap_or_default()).collect();
        for three in triangles {
            self.looks.triangles.push(Look {
                material,
                corners: three.map(|place| corners[place]),
            });
        }
    }

    /// Reads the materials of a file. Names of files may have blanks.
    fn library(&mut self, name: &str) {
        self.libraries += 1;
        if self.libraries > MOST_LIBRARIES {
            return;
        }
        let path = find(self.folder, name);
        let bytes = match crate::bytes_up_to(&path, LARGEST_LIBRARY) {
            Ok(bytes) => bytes,
            Err(error) => {
                let problem = format!("its materials in `{}`: {error}", clean(name));
                return self.looks.problems.push(problem);
            }
        };
        let mut here: Option<usize> = None;
        let mut names = Vec::new();
        let text = String::from_utf8_lossy(&bytes);
        for (_, line) in lines(text.trim_start_matches('\u{feff}')) {
            let line = line.trim();
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            if word == "newmtl" {
                if self.looks.materials.len() == MOST_MATERIALS {
                    let problem = format!("it has more than {MOST_MATERIALS} materials");
                    self.looks.problems.push(problem);
                    break;
                }
                here = Some(self.looks.materials.len());
                names.push((rest.to_owned(), PLAIN));
                self.looks.materials.push(Material {
                    colour: [u8::MAX; 3],
                    picture: None,
                    wrap: [Wrap::Repeat; 2],
                    alpha: 1.0,
                    alpha_mode: AlphaMode::Opaque,
                });
                continue;
            }
            let material = here.and_then(|at| self.looks.materials.get_mut(at));
            let (Some(material), Some((_, mapping))) = (material, names.last_mut()) else {
                continue;
            };
            match word {
                "Kd" => {
                    let numbers = rest.split_whitespace().map_while(|word| word.parse().ok());
                    let numbers: Vec<f64> = numbers.collect();
                    match numbers[..] {
                        [red, green, blue] => material.colour = colour([red, green, blue]),
                        [grey] => material.colour = colour([grey; 3]),
                        // A spectrum, or no numbers.
                        _ => {}
                    }
                }
                // The opacity, and its difference to 1.
                "d" => set_alpha(material, rest, |opacity| opacity),
                "Tr" => set_alpha(material, rest, |lack| 1.0 - lack),
                "map_Kd" => {
                    let (file, clamps);
                    (file, clamps, *mapping) = picture(rest);
                    if !file.is_empty() {
                        material.picture = Some(Picture::File(find(self.folder, file)));
                        material.wrap = [if clamps { Wrap::Clamp } else { Wrap::Repeat }; 2];
                    }
                }
                _ => {}
            }
        }
        let first = self.looks.materials.len() - names.len();
        for (at, (name, mapping)) in names.into_iter().enumerate() {
            self.names.insert(name, ((first + at) as u32, mapping));
        }
    }
}

/// Sets the opacity of a material to a function of the last number of a line: `d -halo` has a word
/// before it.
fn set_alpha(material: &mut Material, line: &str, opacity: fn(f32) -> f32) {
    let number = line.split_whitespace().next_back();
    let number = number.and_then(|word| word.parse::<f32>().ok());
    if let Some(number) = number.filter(|number| number.is_finite()) {
        material.alpha = opacity(number).clamp(0.0, 1.0);
        material.alpha_mode = if material.alpha < 1.0 {
            AlphaMode::Blend
        } else {
            AlphaMode::Opaque
        };
    }
}

/// The file of a `map_Kd`, whether its sides are continued, and where it is.
fn picture(mut rest: &str) -> (&str, bool, Mapping) {
    let (mut clamps, mut mapping) = (false, PLAIN);
    while rest.starts_with('-') {
        let (option, after) = word(rest);
        rest = after;
        let most = match option {
            "-s" | "-o" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        let mut numbers: Vec<f32> = Vec::new();
        for given in 0..most {
            let (argument, after) = word(rest);
            let number = argument.parse::<f32>().ok();
            // The second and the third number may be missing.
            if given > 0 && number.is_none() || after.is_empty() {
                break;
            }
            clamps |= option == "-clamp" && argument == "on";
            numbers.extend(number.filter(|number| number.is_finite()));
            rest = after;
        }
        let target = match option {
            "-s" => &mut mapping.scale,
            "-o" => &mut mapping.offset,
            _ => continue,
        };
        for (target, number) in target.iter_mut().zip(numbers) {
            *target = number;
        }
    }
    (rest, clamps, mapping)
}

/// The first word, and what follows it.
fn word(text: &str) -> (&str, &str) {
    let (first, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (first, rest.trim_start())
}
