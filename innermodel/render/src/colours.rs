//! Colours of bodies and their shading.

use innermodel::{Kind, Vector};

/// The colour where nothing is.
pub(crate) const SKY: [u8; 3] = [200, 215, 235];
/// The colour of bodies without one.
pub(crate) const PLAIN: [u8; 3] = [180, 180, 180];

/// The colour of `#rrggbb`.
pub(crate) fn colour(kind: &Kind) -> [u8; 3] {
    let texture = match kind {
        Kind::Plane(plane) => &plane.texture,
        Kind::Display(display) => &display.plane.texture,
        Kind::Solid(solid) => &solid.texture,
        _ => return PLAIN,
    };
    let digits = texture.strip_prefix('#').filter(|digits| digits.len() == 6);
    let number = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    number.map_or(PLAIN, |number| {
        let [_, red, green, blue] = number.to_be_bytes();
        [red, green, blue]
    })
}

/// The colour of a surface that a ray with the direction `way` meets. Surfaces that face the light
/// are brighter. The light is in the direction `light`, of length 1, or at the camera.
pub(crate) fn shade(
    colour: [u8; 3],
    normal: &Vector,
    way: &Vector,
    light: Option<&Vector>,
) -> [u8; 3] {
    let along = normal.dot(way);
    let facing = match light {
        None => (along / (normal.norm() * way.norm())).abs(),
        // Both sides of a surface are seen.
        Some(light) => (-along.signum() * normal.dot(light) / normal.norm()).max(0.0),
    };
    colour.map(|part| (f64::from(part) * (0.35 + 0.65 * facing)) as u8)
}
