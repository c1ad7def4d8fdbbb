//! Publishes the people in the depth images of a camera.

use crate::Point;
use crate::depths::{Depths, Mount};
use crate::heads::{self, Head, Heights};
use crate::tracks::Tracks;
use std::time::Duration;
use tracker_generated::{Context, KeyPoint, PeopleData, Person, Worker, WorkerError};

/// People and things that may become people.
#[derive(Default)]
pub struct SpecificWorker {
    tracks: Tracks,
    /// When the last image was taken, in ms.
    last: Option<i64>,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self::default())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let image = ctx.camera_rgbd_simple.get_depth("")?;
        if self.last.replace(image.alivetime) == Some(image.alivetime) {
            return Ok(());
        }
        let depths = Depths::new(&image).map_err(WorkerError::Failed)?;
        let params = &ctx.params;
        let mount = Mount {
            height: params.height,
            pitch: params.pitch,
        };
        let heights = Heights {
            shortest: params.shortest,
            tallest: params.tallest,
        };
        let points = depths.points().map(|point| mount.above_floor(point));
        let heads = heads::find(points, heights);
        let patience = ms(params.patience);
        let people = self.tracks.follow(&heads, image.alivetime, patience);
        let people = people.into_iter();
        let people = people.map(|(id, head)| person(id, &head, mount, &depths));
        ctx.human_camera_body.new_people_data(&PeopleData {
            camera_id: image.camera_id,
            timestamp: image.alivetime,
            peoplelist: people.collect(),
        })?;
        Ok(())
    }
}

fn ms(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX)
}

/// A person as the camera sees it.
fn person(id: i32, head: &Head, mount: Mount, depths: &Depths<'_>) -> Person {
    let [x, _, ahead] = head.centre;
    let centre = mount.before_camera(head.centre);
    let [i, j] = depths.pixel(centre);
    let [x, y, z] = single(mount.before_camera([x, 0.0, ahead]));
    let [head_x, head_y, head_z] = single(centre);
    let joint = KeyPoint {
        x: head_x,
        y: head_y,
        z: head_z,
        i,
        j,
        score: head.score as f32,
        ..KeyPoint::default()
    };
    Person {
        id,
        joints: [("head".to_owned(), joint)].into(),
        x,
        y,
        z,
        ..Person::default()
    }
}

fn single(point: Point) -> [f32; 3] {
    point.map(|length| length as f32)
}
