//! The base colours of a glTF file, and the pictures that they name.

use super::{Primitive, Reader, Root, inside, is_look, name_of};
use crate::MeshError;
use crate::looks::{AlphaMode, Look, MOST_MATERIALS, Material, Picture, Wrap, colour, find};
use rc_diagnostics::foreign::clean;
use serde::Deserialize;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

/// How many bytes of buffers all pictures may have.
const MOST_INSIDE: usize = 256 << 20;
/// How many extensions that are not read are named.
const MOST_NAMED: usize = 8;

/// Materials, textures and pictures of a file.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Tables {
    materials: Vec<Described>,
    textures: Vec<Texture>,
    images: Vec<Image>,
    samplers: Vec<Sampler>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Described {
    pbr_metallic_roughness: Base,
    alpha_mode: String,
    alpha_cutoff: Option<f32>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Base {
    base_color_factor: Option<Vec<f64>>,
    base_color_texture: Option<Reference>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Reference {
    index: usize,
    tex_coord: usize,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Texture {
    sampler: Option<usize>,
    source: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Image {
    uri: Option<String>,
    buffer_view: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Sampler {
    wrap_s: Option<u32>,
    wrap_t: Option<u32>,
}

impl Root {
    /// A picture. `left` is how many bytes of buffers pictures may still have.
    fn picture(
        &self,
        at: usize,
        buffers: &[Cow<'_, [u8]>],
        folder: &Path,
        left: &mut usize,
    ) -> Result<Picture, String> {
        let missing = || "a picture is missing".to_owned();
        let image = self.look.images.get(at).ok_or_else(missing)?;
        if let Some(uri) = &image.uri {
            let inside = inside(uri).map_err(|error| format!("a picture: {error}"))?;
            return Ok(match inside {
                Some(bytes) => Picture::Bytes(bytes.into()),
                None => Picture::File(find(folder, &name_of(uri))),
            });
        }
        let view = image
            .buffer_view
            .and_then(|view| self.buffer_views.get(view));
        let bytes = view.and_then(|view| view.bytes(buffers));
        let bytes = bytes.ok_or_else(missing)?;
        let rest = left.checked_sub(bytes.len());
        *left = rest.ok_or_else(|| "its pictures have more than 256 MiB".to_owned())?;
        Ok(Picture::Bytes(bytes.into()))
    }
}

impl Reader<'_> {
    /// Adds all materials of the file, in their order.
    pub(super) fn materials(&mut self, folder: &Path) {
        let (root, buffers) = (self.root, &self.buffers);
        let Some(looks) = self.looks.as_mut() else {
            return;
        };
        let tables = &root.look;
        let needed = root.extensions_required.iter().filter(|name| is_look(name));
        for name in needed.take(MOST_NAMED) {
            let problem = format!(
                "its looks need the extension `{}`, which is not read",
                clean(name)
            );
            looks.problems.push(problem);
        }
        // Each picture once, however many materials have it.
        let mut known: HashMap<usize, Option<Picture>> = HashMap::new();
        let mut left = MOST_INSIDE;
        for described in tables.materials.iter().take(MOST_MATERIALS) {
            let base = &described.pbr_metallic_roughness;
            let reference = base.base_color_texture.as_ref();
            let texture = reference.and_then(|to| tables.textures.get(to.index));
            let sampler = texture.and_then(|texture| tables.samplers.get(texture.sampler?));
            let image = texture.and_then(|texture| texture.source);
            let picture = match image {
                _ if reference.is_none() => None,
                Some(at) => known
                    .entry(at)
                    .or_insert_with(|| match root.picture(at, buffers, folder, &mut left) {
                        Ok(picture) => Some(picture),
                        Err(problem) => {
                            looks.problems.push(problem);
                            None
                        }
                    })
                    .clone(),
                None => {
                    let problem = "a material has a picture without a source".to_owned();
                    looks.problems.push(problem);
                    None
                }
            };
            let factor = |at: usize| {
                let factor = base.base_color_factor.as_ref();
                let factor = factor.and_then(|factor| factor.get(at));
                factor.copied().unwrap_or(1.0)
            };
            let wraps = sampler.map_or([None; 2], |sampler| [sampler.wrap_s, sampler.wrap_t]);
            looks.materials.push(Material {
                colour: colour([factor(0), factor(1), factor(2)].map(encoded)),
                picture,
                wrap: wraps.map(|wrap| match wrap {
                    Some(33071) => Wrap::Clamp,
                    Some(33648) => Wrap::Mirror,
                    _ => Wrap::Repeat,
                }),
                alpha: factor(3).clamp(0.0, 1.0) as f32,
                alpha_mode: match described.alpha_mode.as_str() {
                    "MASK" => AlphaMode::Mask(described.alpha_cutoff.unwrap_or(0.5)),
                    "BLEND" => AlphaMode::Blend,
                    _ => AlphaMode::Opaque,
                },
            });
        }
        if tables.materials.len() > MOST_MATERIALS {
            let problem = format!("it has more than {MOST_MATERIALS} materials");
            looks.problems.push(problem);
        }
    }

    /// Says how the triangles with these corners look.
    pub(super) fn paint(
        &mut self,
        primitive: &Primitive,
        corners: &[u32],
    ) -> Result<(), MeshError> {
        let Some(looks) = self.looks.as_ref() else {
            return Ok(());
        };
        let material = primitive.material.filter(|at| *at < looks.materials.len());
        let described = material.and_then(|at| self.root.look.materials.get(at));
        let base = described.map(|described| &described.pbr_metallic_roughness);
        let reference = base.and_then(|base| base.base_color_texture.as_ref());
        let attributes = &primitive.attributes;
        let places = reference.and_then(|reference| {
            let name = format!("TEXCOORD_{}", reference.tex_coord);
            attributes.get(&name).copied()
        });
        // Each vertex has a place, as each has a position.
        let count = |at: usize| self.count(at).ok();
        let position = attributes.get("POSITION").and_then(|at| count(*at));
        let places = places.filter(|at| count(*at) == position);
        let places = places.map_or(Ok(Vec::new()), |places| self.numbers(places, 2))?;
        let place = |corner: u32| {
            let at = corner as usize * 2;
            let place = places
                .get(at..at + 2)
                .map(|two| [two[0] as f32, two[1] as f32]);
            place
                .filter(|two| two.iter().all(|n| n.is_finite()))
                .unwrap_or_default()
        };
        let seen = corners.chunks_exact(3).map(|three| Look {
            material: material.map(|at| at as u32),
            corners: [place(three[0]), place(three[1]), place(three[2])],
        });
        let seen: Vec<Look> = seen.collect();
        if let Some(looks) = self.looks.as_mut() {
            looks.triangles.extend(seen);
        }
        Ok(())
    }
}

/// The part of a colour as pictures and screens have it, of one that is proportional to light.
fn encoded(part: f64) -> f64 {
    if part <= 0.003_130_8 {
        part * 12.92
    } else {
        1.055 * part.powf(1.0 / 2.4) - 0.055
    }
}
