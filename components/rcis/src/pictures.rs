//! Cameras, with and without depth.

use crate::SpecificWorker;
use crate::motors::motor_states;
use crate::ranges::period_ms;
use crate::robots::state_of_robot;
use innermodel::NodeId;
use innermodel_simulation::{Error, Picture, World};
use rcis_generated::interfaces::rgbd as calls;
use rcis_generated::interfaces::{camera_rgbd_simple as rgbd_calls, camera_simple as simple_calls};
use rcis_generated::types::{
    robo_comp_camera_rgbd_simple as simple_rgbd, robo_comp_camera_simple as simple,
    robo_comp_rgbd as full,
};
use rcis_generated::{
    Cameras, ColorSeq, Context, DepthSeq, IdImage, Image, Member, MotorStateMap, PixelFormat,
    PointSeq, Registration, RgbdCameras, Rgbds, SimpleCameras, TBaseState, TRGBDParams,
};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

/// The most bytes of a picture of the interface `Camera`, and its most pixels along one side.
const MOST_BYTES: usize = 2_100_000;
const LONGEST_SIDE: usize = 4096;

fn ms(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX)
}

fn side(pixels: usize) -> i32 {
    i32::try_from(pixels).unwrap_or(i32::MAX)
}

fn bytes(picture: &Picture) -> Vec<u8> {
    picture.image.colours.as_flattened().to_vec()
}

/// Depths in mm; 0 where nothing was measured.
fn depths(picture: &Picture) -> Vec<f32> {
    let depths = picture.image.depths.iter();
    depths
        .map(|depth| {
            if depth.is_finite() {
                *depth as f32
            } else {
                0.0
            }
        })
        .collect()
}

fn frame_period(world: &World, id: &str) -> f32 {
    let signal = world.signal(id);
    period_ms(signal.map_or(0.0, |signal| signal.rate), world.step_time()) as f32
}

fn simple_image(world: &mut World, id: &str) -> Result<simple_rgbd::TImage, Error> {
    let picture = world.picture(id)?;
    let focal = picture.camera.focal as i32;
    Ok(simple_rgbd::TImage {
        compressed: false,
        camera_id: 0,
        width: side(picture.image.width),
        height: side(picture.image.height),
        depth: 3,
        focalx: focal,
        focaly: focal,
        alivetime: ms(picture.time),
        period: frame_period(world, id),
        image: bytes(&picture),
    })
}

fn simple_depth(world: &mut World, id: &str) -> Result<simple_rgbd::TDepth, Error> {
    let picture = world.picture(id)?;
    let focal = picture.camera.focal as i32;
    Ok(simple_rgbd::TDepth {
        compressed: false,
        camera_id: 0,
        width: side(picture.image.width),
        height: side(picture.image.height),
        focalx: focal,
        focaly: focal,
        alivetime: ms(picture.time),
        period: frame_period(world, id),
        depth_factor: 0.001,
        depth: depths(&picture)
            .into_iter()
            .flat_map(f32::to_le_bytes)
            .collect(),
    })
}

fn simple_points(world: &mut World, id: &str) -> Result<simple_rgbd::TPoints, Error> {
    let picture = world.picture(id)?;
    let points = picture.points().map(|point| {
        let point = point.unwrap_or_default();
        simple_rgbd::Point3D {
            x: point.x as f32,
            y: point.y as f32,
            z: point.z as f32,
        }
    });
    Ok(simple_rgbd::TPoints {
        points: points.collect(),
        alivetime: ms(picture.time),
        period: frame_period(world, id),
        compressed: false,
    })
}

/// Checks the name that a client gives one camera among several.
fn simple<T>(
    world: &mut World,
    member: &Member,
    camera: &str,
    get: impl FnOnce(&mut World, &str) -> Result<T, Error>,
) -> Result<T, simple_rgbd::HardwareFailedException> {
    if !camera.is_empty() && camera != member.name() {
        let camera = rc_diagnostics::foreign::clean(camera);
        let what = format!("this is the camera `{}`, not `{camera}`", member.name());
        return Err(simple_rgbd::HardwareFailedException { what });
    }
    let failed = |error: Error| simple_rgbd::HardwareFailedException {
        what: error.to_string(),
    };
    get(world, member.name()).map_err(failed)
}

/// The last frame of a camera, with motors and base of its robot.
fn whole(
    world: &mut World,
    member: &Member,
) -> Result<(Arc<Picture>, MotorStateMap, TBaseState), full::HardwareFailedException> {
    let failed = |error: Error| full::HardwareFailedException {
        what: error.to_string(),
    };
    let picture = world.picture(member.name()).map_err(failed)?;
    let owner = world.owner(member.name()).map_err(failed)?;
    let motors = motor_states(world, &owner);
    // A camera without a robot has no base.
    let base = state_of_robot(world, member.name()).unwrap_or_default();
    Ok((picture, motors, base))
}

fn colours(picture: &Picture) -> ColorSeq {
    let colours = picture.image.colours.iter();
    colours
        .map(|[red, green, blue]| full::ColorRGB {
            red: *red,
            green: *green,
            blue: *blue,
        })
        .collect()
}

fn cloud(picture: &Picture) -> PointSeq {
    let points = picture.points().map(|point| {
        let w = if point.is_some() { 1.0 } else { 0.0 };
        let point = point.unwrap_or_default();
        full::PointXYZ {
            x: point.x as f32,
            y: point.y as f32,
            z: point.z as f32,
            w,
        }
    });
    points.collect()
}

/// The nodes of the pixels, each of them named once.
pub(crate) fn id_image(picture: &Picture) -> IdImage {
    let (mut numbers, mut ids) = (HashMap::new(), Vec::new());
    let mut number = |node: &Option<NodeId>| {
        // The picture has the tree that it shows, so each of its nodes is there.
        let node = node.and_then(|node| picture.tree.node(node).ok());
        node.map_or(-1, |node| {
            *numbers.entry(node.node_id()).or_insert_with(|| {
                ids.push(node.id().to_owned());
                ids.len() as i32 - 1
            })
        })
    };
    let pixels = picture.image.nodes.iter().map(&mut number).collect();
    IdImage {
        time: i64::try_from(picture.time.as_nanos()).unwrap_or(i64::MAX),
        width: side(picture.image.width),
        height: side(picture.image.height),
        pixels,
        ids,
    }
}

impl Cameras<Context> for SpecificWorker {
    fn get_image(&mut self, _ctx: &mut Context, member: &Member) -> Image {
        let picture = match self.worlds.main.picture(member.name()) {
            Ok(picture) => picture,
            Err(error) => {
                self.warnings.log(error.to_string());
                return Image::default();
            }
        };
        let (width, height) = (picture.image.width, picture.image.height);
        let data = bytes(&picture);
        if data.len() > MOST_BYTES || width.max(height) > LONGEST_SIDE {
            self.warnings.log(format!(
                "the interface Camera has no pictures of {width} × {height} pixels, as those of `{}`",
                member.name()
            ));
            return Image::default();
        }
        let count = |number: u128| i64::try_from(number).unwrap_or(i64::MAX);
        Image {
            captured: count(picture.time.as_nanos()),
            number: count(u128::from(picture.number) + 1),
            width: side(width),
            height: side(height),
            format: PixelFormat::Rgb,
            frame: member.name().chars().take(32).collect(),
            data,
        }
    }
}

impl SimpleCameras<Context> for SpecificWorker {
    fn get_image(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<simple::TImage, simple_calls::GetImageError> {
        let image = simple_image(&mut self.worlds.main, member.name());
        let image = image.map_err(|error| simple::HardwareFailedException {
            what: error.to_string(),
        })?;
        Ok(simple::TImage {
            width: image.width,
            height: image.height,
            depth: image.depth,
            image: image.image,
        })
    }
}

impl RgbdCameras<Context> for SpecificWorker {
    fn get_image(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        camera: String,
    ) -> Result<simple_rgbd::TImage, rgbd_calls::GetImageError> {
        Ok(simple(
            &mut self.worlds.main,
            member,
            &camera,
            simple_image,
        )?)
    }

    fn get_depth(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        camera: String,
    ) -> Result<simple_rgbd::TDepth, rgbd_calls::GetDepthError> {
        Ok(simple(
            &mut self.worlds.main,
            member,
            &camera,
            simple_depth,
        )?)
    }

    fn get_points(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        camera: String,
    ) -> Result<simple_rgbd::TPoints, rgbd_calls::GetPointsError> {
        Ok(simple(
            &mut self.worlds.main,
            member,
            &camera,
            simple_points,
        )?)
    }

    fn get_all(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        camera: String,
    ) -> Result<simple_rgbd::Trgbd, rgbd_calls::GetAllError> {
        Ok(simple(
            &mut self.worlds.main,
            member,
            &camera,
            |world, id| {
                Ok(simple_rgbd::Trgbd {
                    image: simple_image(world, id)?,
                    depth: simple_depth(world, id)?,
                })
            },
        )?)
    }
}

impl Rgbds<Context> for SpecificWorker {
    fn get_rgbd_params(&mut self, _ctx: &mut Context, member: &Member) -> TRGBDParams {
        let picture = self.worlds.main.picture(member.name());
        let Ok(picture) = picture else {
            return TRGBDParams::default();
        };
        let period = frame_period(&self.worlds.main, member.name());
        let image = full::CameraParameters {
            focal: picture.camera.focal as i32,
            width: side(picture.image.width),
            height: side(picture.image.height),
            size: side(picture.image.colours.len()),
            fps: (1000.0 / period).round() as i32,
        };
        TRGBDParams {
            color: image.clone(),
            depth: image,
            timer_period: period as i32,
            talk_to_base: true,
            talk_to_joint_motor: true,
            driver: "rcis".to_owned(),
            device: member.name().to_owned(),
        }
    }

    /// Both images have the same pixels, whatever the request.
    fn set_registration(
        &mut self,
        _ctx: &mut Context,
        _member: &Member,
        _value: Registration,
    ) -> Result<(), calls::SetRegistrationError> {
        Ok(())
    }

    fn get_registration(
        &mut self,
        _ctx: &mut Context,
        _member: &Member,
    ) -> Result<Registration, calls::GetRegistrationError> {
        Ok(Registration::DepthInColor)
    }

    fn get_data(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<calls::GetDataAnswer, calls::GetDataError> {
        let (picture, motors, base) = whole(&mut self.worlds.main, member)?;
        Ok((bytes(&picture), depths(&picture), motors, base))
    }

    fn get_depth_in_ir(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<calls::GetDepthInIRAnswer, calls::GetDepthInIRError> {
        let (picture, motors, base) = whole(&mut self.worlds.main, member)?;
        Ok((depths(&picture), motors, base))
    }

    fn get_image(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(ColorSeq, DepthSeq, PointSeq, MotorStateMap, TBaseState), calls::GetImageError>
    {
        let (picture, motors, base) = whole(&mut self.worlds.main, member)?;
        let (colours, points) = (colours(&picture), cloud(&picture));
        Ok((colours, depths(&picture), points, motors, base))
    }

    fn get_depth(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(DepthSeq, MotorStateMap, TBaseState), calls::GetDepthError> {
        let (picture, motors, base) = whole(&mut self.worlds.main, member)?;
        Ok((depths(&picture), motors, base))
    }

    fn get_rgb(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(ColorSeq, MotorStateMap, TBaseState), calls::GetRGBError> {
        let (picture, motors, base) = whole(&mut self.worlds.main, member)?;
        Ok((colours(&picture), motors, base))
    }

    fn get_xyz(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<(PointSeq, MotorStateMap, TBaseState), calls::GetXYZError> {
        let (picture, motors, base) = whole(&mut self.worlds.main, member)?;
        Ok((cloud(&picture), motors, base))
    }
}
