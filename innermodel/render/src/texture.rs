//! Textures: pictures on the sides of boxes, and on the triangles of meshes.

use innermodel::{Transform, Vector};
use innermodel_mesh::{Picture, Wrap};
use std::fs::File;
use std::io::{self, Cursor, Read};
use std::path::Path;
use thiserror::Error;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The largest file that is read, in bytes.
const LARGEST: u64 = 64 << 20;
/// The greatest width and height in pixels.
const MOST_SIDE: usize = 8192;
/// How many pixels all pictures of a scene may have.
pub(crate) const MOST_PIXELS: usize = 1 << 27;

/// Error of a file that gives no texture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TextureError {
    /// There is no such file, or it was not searched.
    #[error("the file was not found when the node was read")]
    NotFound,
    /// The system cannot read the file.
    #[error("{0}")]
    Unreadable(#[from] io::Error),
    /// The file is larger than 64 MiB, or the picture than 8192 × 8192 pixels.
    #[error("expected at most 64 MiB and 8192 × 8192 pixels")]
    TooLarge,
    /// With this one, the pictures of the scene would have more than 134,217,728 pixels.
    #[error("expected at most {MOST_PIXELS} pixels in all pictures of the scene")]
    TooMany,
    /// The content is neither PNG nor JPEG.
    #[error("expected a picture in PNG or JPEG")]
    UnknownFormat,
    /// The content is wrong.
    #[error("{0}")]
    Wrong(String),
}

/// A picture.
#[derive(Debug)]
pub(crate) struct Texture {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
    /// The opacity of each pixel. Empty if all are opaque.
    alphas: Vec<u8>,
}

impl Texture {
    /// Reads a file. Its first bytes tell its format. It may have `left` pixels.
    pub(crate) fn read(path: &Path, left: usize) -> Result<Self, TextureError> {
        // Check before opening: opening a device can have side effects.
        let about = std::fs::metadata(path)?;
        if !about.is_file() {
            return Err(io::Error::other("this is not a regular file").into());
        }
        if about.len() > LARGEST {
            return Err(TextureError::TooLarge);
        }
        let mut bytes = Vec::new();
        File::open(path)?.take(LARGEST).read_to_end(&mut bytes)?;
        Self::decode(&bytes, left)
    }

    /// Reads a picture that a mesh names or contains. It may have `left` pixels.
    pub(crate) fn of_mesh(picture: &Picture, left: usize) -> Result<Self, TextureError> {
        match picture {
            Picture::File(path) => Self::read(path, left),
            Picture::Bytes(bytes) if bytes.len() as u64 > LARGEST => Err(TextureError::TooLarge),
            Picture::Bytes(bytes) => Self::decode(bytes, left),
        }
    }

    fn decode(bytes: &[u8], left: usize) -> Result<Self, TextureError> {
        if bytes.starts_with(b"\x89PNG") {
            from_png(bytes, left)
        } else if bytes.starts_with(b"\xff\xd8") {
            from_jpeg(bytes, left)
        } else {
            Err(TextureError::UnknownFormat)
        }
    }

    /// Whether nothing is seen through it.
    pub(crate) fn is_opaque(&self) -> bool {
        self.alphas.is_empty()
    }

    /// How many pixels it has.
    pub(crate) fn pixels(&self) -> usize {
        self.pixels.len()
    }

    /// The pixel at a place, from (0, 0) at the top left to (1, 1).
    fn place(&self, u: f64, v: f64) -> usize {
        let place = |part: f64, count: usize| ((part * count as f64) as usize).min(count - 1);
        place(v, self.height) * self.width + place(u, self.width)
    }

    /// The colour at a place.
    fn at(&self, u: f64, v: f64) -> [u8; 3] {
        self.pixels[self.place(u, v)]
    }

    /// The opacity at a place, from 0 to 1.
    fn alpha(&self, u: f64, v: f64) -> f32 {
        let alpha = self.alphas.get(self.place(u, v));
        alpha.map_or(1.0, |alpha| f32::from(*alpha) / 255.0)
    }
}

fn wrong(error: &dyn std::fmt::Display) -> TextureError {
    TextureError::Wrong(error.to_string())
}

fn texture(
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
    alphas: Vec<u8>,
) -> Result<Texture, TextureError> {
    if width == 0 || height == 0 || pixels.len() != width * height {
        return Err(TextureError::Wrong("the picture is cut".to_owned()));
    }
    Ok(Texture {
        width,
        height,
        pixels,
        alphas,
    })
}

/// Checks the size before the pixels get memory.
fn check_size(width: usize, height: usize, left: usize) -> Result<(), TextureError> {
    if width.max(height) > MOST_SIDE {
        return Err(TextureError::TooLarge);
    }
    if width * height > left {
        return Err(TextureError::TooMany);
    }
    Ok(())
}

fn from_png(bytes: &[u8], left: usize) -> Result<Texture, TextureError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    // Palettes and bits become bytes, 16 bits become 8.
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(|e| wrong(&e))?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    check_size(width, height, left)?;
    let size = reader.output_buffer_size().ok_or(TextureError::TooLarge)?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(|e| wrong(&e))?;
    let data = &data[..frame.buffer_size()];
    let samples = frame.color_type.samples();
    let pixels = data.chunks_exact(samples).map(|pixel| match *pixel {
        [red, green, blue, ..] => [red, green, blue],
        [grey, ..] => [grey; 3],
        [] => [0; 3],
    });
    // Grey or three colours, perhaps followed by the opacity.
    let opacities = data.chunks_exact(samples).map(|pixel| pixel[samples - 1]);
    let has_alpha = samples.is_multiple_of(2);
    let alphas = if has_alpha && opacities.clone().any(|alpha| alpha < u8::MAX) {
        opacities.collect()
    } else {
        Vec::new()
    };
    texture(width, height, pixels.collect(), alphas)
}

fn from_jpeg(bytes: &[u8], left: usize) -> Result<Texture, TextureError> {
    let options = DecoderOptions::default()
        .set_max_width(MOST_SIDE)
        .set_max_height(MOST_SIDE)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| wrong(&e))?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    check_size(width, height, left)?;
    let data = decoder.decode().map_err(|e| wrong(&e))?;
    texture(width, height, data.as_chunks::<3>().0.to_vec(), Vec::new())
}

/// Look of a surface.
#[derive(Clone, Copy)]
pub(crate) enum Paint<'c> {
    /// One colour everywhere.
    Colour([u8; 3]),
    /// Each side of a box shows a picture, upright as seen from outside.
    Box {
        texture: &'c Texture,
        /// The lengths of the box.
        size: [f64; 3],
        /// From the camera to the box.
        to_box: Transform,
    },
    /// A triangle shows a part of a picture.
    Triangle {
        texture: &'c Texture,
        /// Treatment of coordinates beyond the picture.
        wrap: [Wrap; 2],
        /// Each pixel of the picture is multiplied by this colour.
        tint: [u8; 3],
        /// In the frame of the camera.
        corners: [Vector; 3],
        /// Where the corners are in the picture.
        places: [[f32; 2]; 3],
    },
}

impl Paint<'_> {
    /// The opacity that a picture has at a point of the surface, in the frame of the camera. Those
    /// of boxes are opaque.
    pub(crate) fn alpha(&self, point: &Vector) -> f32 {
        let Self::Triangle {
            texture,
            wrap,
            corners,
            places,
            ..
        } = self
        else {
            return 1.0;
        };
        let [u, v] = interpolated(point, corners, places);
        texture.alpha(wrap[0].place(u), wrap[1].place(v))
    }

    /// The colour at a point of the surface, in the frame of the camera.
    pub(crate) fn at(&self, point: &Vector) -> [u8; 3] {
        let (texture, size, to_box) = match self {
            Self::Colour(colour) => return *colour,
            Self::Box {
                texture,
                size,
                to_box,
            } => (texture, size, to_box),
            Self::Triangle {
                texture,
                wrap,
                tint,
                corners,
                places,
            } => {
                let [u, v] = interpolated(point, corners, places);
                let colour = texture.at(wrap[0].place(u), wrap[1].place(v));
                let tinted = |at: usize| (u16::from(colour[at]) * u16::from(tint[at]) / 255) as u8;
                return [tinted(0), tinted(1), tinted(2)];
            }
        };
        let point = to_box.vector(point) + to_box.translation;
        // From −0.5 to 0.5 along each axis; a box without a depth has none there.
        let part = [0, 1, 2].map(|axis| {
            let part = point[axis] / size[axis];
            if part.is_finite() { part } else { 0.5 }
        });
        let [x, y, z] = part;
        // The side is where the point is farthest out. y is up, and the side of −z is the front.
        let (right, up) = if z.abs() >= x.abs().max(y.abs()) {
            (-x * z.signum(), y)
        } else if x.abs() >= y.abs() {
            (z * x.signum(), y)
        } else {
            (x, z * y.signum())
        };
        texture.at((right + 0.5).clamp(0.0, 1.0), (0.5 - up).clamp(0.0, 1.0))
    }
}

/// The place in a picture of a point of a triangle, by its barycentric coordinates.
fn interpolated(point: &Vector, corners: &[Vector; 3], places: &[[f32; 2]; 3]) -> [f64; 2] {
    let (one, two) = (corners[1] - corners[0], corners[2] - corners[0]);
    let (normal, from) = (one.cross(&two), point - corners[0]);
    let area = normal.norm_squared();
    let (second, third) = (
        from.cross(&two).dot(&normal) / area,
        one.cross(&from).dot(&normal) / area,
    );
    [0, 1].map(|axis| {
        let [a, b, c] = places.map(|place| f64::from(place[axis]));
        a + (b - a) * second + (c - a) * third
    })
}

#[cfg(test)]
mod tests {
    use super::{MOST_PIXELS, Texture};

    /// The opacities are compared once, when the picture is read: many materials may share it.
    #[test]
    fn opaque_pictures_keep_no_opacities() {
        for (last, expected) in [(255, 0), (254, 2)] {
            for (form, pixels) in [
                (png::ColorType::Rgba, vec![1, 2, 3, 255, 4, 5, 6, last]),
                (png::ColorType::GrayscaleAlpha, vec![1, 255, 2, last]),
            ] {
                let mut bytes = Vec::new();
                let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
                encoder.set_color(form);
                let mut writer = encoder.write_header().expect("a header");
                writer.write_image_data(&pixels).expect("the pixels");
                drop(writer);
                let texture = Texture::decode(&bytes, MOST_PIXELS).expect("a texture");
                assert_eq!(texture.alphas.len(), expected, "{form:?} {last}");
                assert_eq!(texture.is_opaque(), last == 255, "{form:?}");
            }
        }
    }
}
