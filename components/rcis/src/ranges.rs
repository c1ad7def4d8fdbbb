//! Sensors that measure ranges and contacts.

use crate::SpecificWorker;
use crate::robots::{is_below, state_of_robot};
use crate::warnings::Warnings;
use innermodel::{Kind, Point, frames, sensors};
use innermodel_simulation::{CloudPoint, Error, World};
use rcis_generated::interfaces::ultrasound as sonar_calls;
use rcis_generated::types::robo_comp_laser::TData;
use rcis_generated::types::robo_comp_lidar3_d::{TData as LidarData, TPoint};
use rcis_generated::types::{
    robo_comp_bumper as bumper, robo_comp_touch_sensor as touch_sensor,
    robo_comp_ultrasound as ultrasound,
};
use rcis_generated::{
    Bumpers, Context, LaserConfData, Lasers, Lidars, Member, SensorMap, SensorStateMap,
    SensorsState, SonarPoseList, TBaseState, TDataImage, TLaserData, TouchSensors, Ultrasounds,
};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::time::Duration;

/// The time between two frames of a sensor, in ms.
pub(crate) fn period_ms(rate: f64, step: Duration) -> f64 {
    if rate > 0.0 {
        1000.0 / rate
    } else {
        step.as_secs_f64() * 1000.0
    }
}

fn ms(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX)
}

fn sweep(world: &mut World, id: &str) -> Result<TLaserData, Error> {
    let scan = world.scan(id)?;
    // The interface counts angles to the left, the tree to the right.
    let measure = scan.ranges.iter().map(|range| TData {
        angle: -range.angle as f32,
        dist: range.distance as f32,
    });
    Ok(measure.collect())
}

fn laser_conf(world: &World, id: &str) -> Result<LaserConfData, Error> {
    let tree = world.tree();
    let node = tree.node(id)?;
    let Kind::Laser(laser) = node.kind() else {
        return Ok(LaserConfData::default());
    };
    let last = i32::try_from(laser.measures).unwrap_or(i32::MAX);
    let steps = f64::from(laser.measures.saturating_sub(1).max(1));
    Ok(LaserConfData {
        driver: "rcis".to_owned(),
        device: id.to_owned(),
        static_conf: 1,
        max_measures: last,
        max_degrees: laser.angle.to_degrees().round() as i32,
        max_range: laser.max as i32,
        min_range: laser.min as i32,
        ini_range: 0,
        end_range: (last - 1).max(0),
        cluster: 1,
        sample_rate: period_ms(laser.signal.rate, world.step_time()) as i32,
        angle_res: (laser.angle / steps) as f32,
        angle_ini: (-laser.angle / 2.0) as f32,
    })
}

/// The points of a lidar of which `keeps` says so, in the axes of the interface.
fn points(
    world: &mut World,
    warnings: &mut Warnings,
    id: &str,
    name: &str,
    mut keeps: impl FnMut(&CloudPoint) -> bool,
) -> Result<LidarData, Error> {
    if !name.is_empty() && name != id {
        // Without the name: a client cannot fill the list of warnings.
        warnings.log(format!("`{id}` is asked for a lidar of another name"));
        return Ok(LidarData::default());
    }
    let cloud = world.cloud(id)?;
    let tree = world.tree();
    let rate = tree
        .node(id)?
        .kind()
        .signal()
        .map_or(0.0, |signal| signal.rate);
    let points = cloud.points.iter().filter(|point| keeps(point));
    Ok(LidarData {
        points: points.map(point_out).collect(),
        period: period_ms(rate, world.step_time()) as f32,
        timestamp: ms(cloud.time),
    })
}

/// The points that the first camera of the lidar's robot shows.
fn projected(
    world: &mut World,
    warnings: &mut Warnings,
    id: &str,
    name: &str,
) -> Result<LidarData, Error> {
    let tree = world.tree();
    let owner = world.owner(id)?;
    let camera = tree.nodes().find_map(|node| {
        let camera = match node.kind() {
            Kind::Camera(camera) => &camera.camera,
            Kind::Rgbd(rgbd) => &rgbd.camera,
            _ => return None,
        };
        is_below(node, &owner).then(|| (node.node_id(), camera.clone()))
    });
    let Some((node, camera)) = camera else {
        return Ok(LidarData::default());
    };
    let there = tree.between(node, id)?;
    let pixel = |point: &Point| {
        let (u, v) = sensors::project(&camera, &there.point(point))?;
        let is_inside = u >= 0.0 && v >= 0.0 && u < camera.width && v < camera.height;
        is_inside.then_some((u as i32, v as i32))
    };
    let mut pixels = Vec::new();
    let mut data = points(world, warnings, id, name, |point| {
        let found = pixel(&point.point);
        pixels.extend(found);
        found.is_some()
    })?;
    for (point, (x, y)) in data.points.iter_mut().zip(pixels) {
        (point.pixel_x, point.pixel_y) = (x, y);
    }
    Ok(data)
}

/// The sensors of a bus.
fn bus(world: &World, tag: &str, owner: &str) -> Vec<String> {
    let groups = world.groups(&[tag]);
    let own = groups.into_iter().find(|(name, _)| name == owner);
    own.map_or_else(Vec::new, |(_, sensors)| sensors)
}

fn range(world: &mut World, id: &str) -> Result<i32, Error> {
    let scan = world.scan(id)?;
    Ok(scan
        .ranges
        .first()
        .map_or(0, |range| range.distance.round() as i32))
}

/// The places of sensors on their owners, to the right and to the front.
fn seat(world: &World, id: &str) -> Result<(f64, f64), Error> {
    let owner = world.owner(id)?;
    let place = world.tree().between(&owner, id)?.point(&Point::origin());
    let place = frames::point_to_robocomp(&place);
    Ok((place.x, place.y))
}

fn clean(name: &str) -> String {
    rc_diagnostics::foreign::clean(name)
}

/// As `rcis.dproto` says.
fn point_out(point: &CloudPoint) -> TPoint {
    let place = frames::point_to_robocomp(&point.point);
    TPoint {
        x: place.x as f32,
        y: place.y as f32,
        z: place.z as f32,
        intensity: 255,
        phi: -point.azimuth as f32,
        theta: (FRAC_PI_2 - point.elevation) as f32,
        r: point.distance as f32,
        distance2d: place.x.hypot(place.y) as f32,
        pixel_x: -1,
        pixel_y: -1,
    }
}

/// Leaves one point of `factor` of each ring.
fn decimation(factor: i32) -> impl FnMut(&CloudPoint) -> bool {
    let (mut ring, mut count) = (None, 0);
    move |point| {
        if ring != Some(point.ring) {
            (ring, count) = (Some(point.ring), 0);
        }
        count += 1;
        factor <= 1 || (count - 1) % factor == 0
    }
}

impl Lasers<Context> for SpecificWorker {
    fn get_laser_data(&mut self, _ctx: &mut Context, member: &Member) -> TLaserData {
        let sweep = sweep(&mut self.worlds.main, member.name());
        self.warnings.or_default(sweep)
    }

    fn get_laser_and_b_state_data(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> (TLaserData, TBaseState) {
        let both = sweep(&mut self.worlds.main, member.name());
        let state = state_of_robot(&self.worlds.main, member.name());
        (
            self.warnings.or_default(both),
            self.warnings.or_default(state),
        )
    }

    fn get_laser_conf_data(&mut self, _ctx: &mut Context, member: &Member) -> LaserConfData {
        let conf = laser_conf(&self.worlds.main, member.name());
        self.warnings.or_default(conf)
    }
}

impl Lidars<Context> for SpecificWorker {
    fn get_lidar_data(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        name: String,
        start: f32,
        len: f32,
        decimation_degree_factor: i32,
    ) -> LidarData {
        let (start, len) = (f64::from(start), f64::from(len));
        let mut keeps = decimation(decimation_degree_factor);
        let data = points(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &name,
            |point| {
                // Rounding of a whole turn loses no point.
                let is_inside = (-point.azimuth - start).rem_euclid(TAU) <= len + 1e-6;
                is_inside && keeps(point)
            },
        );
        self.warnings.or_default(data)
    }

    fn get_lidar_data_with_threshold2d(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        name: String,
        distance: f32,
        decimation_degree_factor: i32,
    ) -> LidarData {
        let mut keeps = decimation(decimation_degree_factor);
        let data = points(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &name,
            |point| point.point.x.hypot(point.point.z) <= f64::from(distance) && keeps(point),
        );
        self.warnings.or_default(data)
    }

    fn get_lidar_data_proyected_in_image(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        name: String,
    ) -> LidarData {
        let data = projected(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &name,
        );
        self.warnings.or_default(data)
    }

    fn get_lidar_data_array_proyected_in_image(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        name: String,
    ) -> TDataImage {
        let data = projected(
            &mut self.worlds.main,
            &mut self.warnings,
            member.name(),
            &name,
        );
        let data = self.warnings.or_default(data);
        TDataImage {
            timestamp: data.timestamp,
            x_array: data.points.iter().map(|point| point.x).collect(),
            y_array: data.points.iter().map(|point| point.y).collect(),
            z_array: data.points.iter().map(|point| point.z).collect(),
            x_pixel: data.points.iter().map(|point| point.pixel_x).collect(),
            y_pixel: data.points.iter().map(|point| point.pixel_y).collect(),
        }
    }
}

impl Ultrasounds<Context> for SpecificWorker {
    fn get_bus_params(&mut self, _ctx: &mut Context, member: &Member) -> ultrasound::BusParams {
        ultrasound::BusParams {
            num_sensors: bus(&self.worlds.main, "ultrasound", member.name()).len() as i32,
            baud_rate: 0,
            basic_period: self.worlds.main.step_time().as_millis() as i32,
        }
    }

    fn get_sensor_params(
        &mut self,
        ctx: &mut Context,
        member: &Member,
        sensor: String,
    ) -> ultrasound::SensorParams {
        let all = Ultrasounds::get_all_sensor_params(self, ctx, member);
        let found = all.into_iter().find(|params| params.name == sensor);
        found.unwrap_or_default()
    }

    fn get_all_sensor_params(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> ultrasound::SensorParamsList {
        let sensors = bus(&self.worlds.main, "ultrasound", member.name()).into_iter();
        let numbered = sensors.zip(0..);
        numbered
            .map(|(name, bus_id)| ultrasound::SensorParams {
                device: "rcis".to_owned(),
                bus_id,
                name,
            })
            .collect()
    }

    fn get_all_sonar_pose(&mut self, _ctx: &mut Context, member: &Member) -> SonarPoseList {
        let sensors = bus(&self.worlds.main, "ultrasound", member.name()).into_iter();
        let seats = sensors.filter_map(|id| seat(&self.worlds.main, &id).ok());
        seats.map(|(x, y)| ultrasound::SonarPose { x, y }).collect()
    }

    fn get_sonars_number(&mut self, _ctx: &mut Context, member: &Member) -> i32 {
        bus(&self.worlds.main, "ultrasound", member.name()).len() as i32
    }

    fn get_sensor_distance(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
        sensor: String,
    ) -> Result<i32, sonar_calls::GetSensorDistanceError> {
        if !bus(&self.worlds.main, "ultrasound", member.name()).contains(&sensor) {
            let what = format!("`{}` has no sensor `{}`", member.name(), clean(&sensor));
            return Err(ultrasound::UnknownSensorException { what }.into());
        }
        let range = range(&mut self.worlds.main, &sensor);
        range.map_err(|error| {
            let what = error.to_string();
            ultrasound::HardwareFailedException { what }.into()
        })
    }

    fn get_all_sensor_distances(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<SensorsState, sonar_calls::GetAllSensorDistancesError> {
        let sensors = bus(&self.worlds.main, "ultrasound", member.name()).into_iter();
        let ranges: Result<SensorsState, Error> = sensors
            .map(|id| range(&mut self.worlds.main, &id))
            .collect();
        ranges.map_err(|error| {
            let what = error.to_string();
            ultrasound::HardwareFailedException { what }.into()
        })
    }
}

impl TouchSensors<Context> for SpecificWorker {
    fn get_values(&mut self, _ctx: &mut Context, member: &Member) -> SensorMap {
        let mut values = SensorMap::new();
        for name in bus(&self.worlds.main, "touchsensor", member.name()) {
            let touch = self
                .worlds
                .main
                .touch(&name)
                .map(|touch| touch.node.is_some());
            let touches = self.warnings.or_default(touch);
            let tree = self.worlds.main.tree();
            let kind = tree.node(&name).map(|node| node.kind().clone());
            let (least, most) = match kind {
                Ok(Kind::TouchSensor(sensor)) => (sensor.min, sensor.max),
                _ => (0.0, 1.0),
            };
            let or = |value: f64, default: f64| if value.is_finite() { value } else { default };
            let value = if touches {
                or(most, 1.0)
            } else {
                or(least, 0.0)
            };
            let state = touch_sensor::SensorState {
                name: name.clone(),
                value: value as f32,
            };
            values.insert(name, state);
        }
        values
    }
}

impl Bumpers<Context> for SpecificWorker {
    fn enable(&mut self, _ctx: &mut Context, member: &Member) {
        self.disabled.remove(member.name());
    }

    fn disable(&mut self, _ctx: &mut Context, member: &Member) {
        self.disabled.insert(member.name().to_owned());
    }

    fn is_enabled(&mut self, _ctx: &mut Context, member: &Member) -> bool {
        !self.disabled.contains(member.name())
    }

    fn reset(&mut self, ctx: &mut Context, member: &Member) {
        Bumpers::enable(self, ctx, member);
    }

    fn get_sensor_data(&mut self, ctx: &mut Context, member: &Member) -> SensorStateMap {
        let is_enabled = Bumpers::is_enabled(self, ctx, member);
        let mut states = SensorStateMap::new();
        for (name, id_number) in bus(&self.worlds.main, "touchsensor", member.name())
            .into_iter()
            .zip(0..)
        {
            let touch = self
                .worlds
                .main
                .touch(&name)
                .map(|touch| touch.node.is_some());
            let touches = self.warnings.or_default(touch);
            let state = bumper::SensorState {
                id_number,
                state: i32::from(touches && is_enabled),
            };
            states.insert(name, state);
        }
        states
    }
}
