//! Point clouds and voxel maps through the C interface: obstacles are hit after they are set and not after they are freed; errors are codes.

use crate::support::quiet;
use linkwork_robot::*;
use std::ptr::{null, null_mut};

const ROBOT: &std::ffi::CStr = c"<robot name='r'><link name='base'/><link name='rod'>
    <collision name='rod'><origin xyz='0.5 0 0'/><geometry><box size='1 0.1 0.1'/></geometry></collision></link>
    <joint name='turn' type='continuous'><parent link='base'/><child link='rod'/><axis xyz='0 0 1'/></joint></robot>";

#[test]
fn what_sensors_see_is_met() {
    let at = LwPose { position: [0.0, 0.0, -0.1], quaternion: [0.0, 0.0, 0.0, 1.0] };
    let ok = LwStatus::Ok;
    let (mut b, mut m, mut r) = (null_mut(), null_mut(), null_mut());
    let (mut cloud, mut map, mut rod) = (9, 9, 9);
    // SAFETY: valid handles of the library, zero-terminated texts, arrays of the required lengths.
    unsafe {
        assert_eq!(lw_builder_new(&mut b), ok);
        assert_eq!(lw_builder_robot_text(b, ROBOT.as_ptr(), LW_ROOT_FIXED, 0), ok);
        assert_eq!(lw_builder_file_shapes(b), ok);
        let (name, world) = (c"cloud".as_ptr(), c"world".as_ptr());
        assert_eq!(lw_builder_point_cloud(b, name, world, null(), 2), ok);
        let cells = [20u32, 20, 2];
        let (name, first) = (c"map".as_ptr(), cells.as_ptr());
        assert_eq!(lw_builder_voxel_map(b, name, world, null(), null(), 0.1), LwStatus::Null);
        assert_eq!(lw_builder_voxel_map(b, name, world, &at, first, 0.1), ok);
        assert_eq!(lw_builder_model(b, &mut m), ok);
        for (name, id) in [(c"cloud", &mut cloud), (c"map", &mut map), (c"rod", &mut rod)] {
            assert_eq!(lw_model_collider(m, name.as_ptr(), id), ok);
        }
        assert_eq!(lw_robot_new(m, &mut r), ok);
        // The parent is the world, so the rod is a neighbour of the world and must be checked
        // explicitly.
        assert_eq!(lw_robot_look_at(r, rod, cloud), ok);
        assert_eq!(lw_robot_look_at(r, rod, map), ok);
        let hit = |q: f64| {
            let (mut out, mut pair) = (false, LwPair { a: 9, b: 9 });
            assert_eq!(lw_robot_collides(r, &q, 1, &mut out, &mut pair), ok);
            out.then_some((pair.a, pair.b))
        };
        assert_eq!(hit(0.0), None);
        // The sphere is next to the rod: 0.8 along it, 0.06 off its axis, with a radius of 0.02.
        let points = [[5.0, 5.0, 5.0, 0.1], [0.8, 0.06, 0.0, 0.02]];
        quiet(|| lw_robot_set_points(r, cloud, points.as_ptr().cast(), 2));
        assert_eq!(hit(0.0), Some((cloud.min(rod), cloud.max(rod))));
        assert_eq!(hit(-1.0), None);
        let mut near = std::mem::zeroed::<LwClosest>();
        assert_eq!(lw_robot_clearance(r, &0.0, 1, 1.0, &mut near), ok);
        assert!(near.found && (near.distance + 0.01).abs() < 1e-12, "{near:?}");
        // An error does not change anything.
        let many = [[0.0; 4]; 3];
        let nan = [0.0, 0.0, f64::NAN, 0.0];
        let negative = [0.0, 0.0, 0.0, -1.0];
        let points = |p: *const f64, n| lw_robot_set_points(r, cloud, p, n);
        assert_eq!(points(many.as_ptr().cast(), 3), LwStatus::NoRoom);
        assert_eq!(points(nan.as_ptr(), 1), LwStatus::NotFinite);
        assert_eq!(points(negative.as_ptr(), 1), LwStatus::OutOfRange);
        assert_eq!(points(null(), 1), LwStatus::Null);
        assert_eq!(lw_robot_set_points(r, rod, nan.as_ptr(), 0), LwStatus::Foreign);
        assert_eq!(lw_robot_set_points(r, 9, nan.as_ptr(), 0), LwStatus::Foreign);
        assert!(hit(0.0).is_some());
        assert_eq!(points(null(), 0), ok);
        assert_eq!(hit(0.0), None);
        // The cell is at the end of the rod after a rotation of 0.5.
        let over = [(0.8 * f64::cos(0.5) / 0.1) as u32, (0.8 * f64::sin(0.5) / 0.1) as u32, 1];
        let cells = [over, [19, 19, 0]];
        assert_eq!(lw_robot_set_cells(r, map, cells.as_ptr().cast(), 2), ok);
        assert_eq!(hit(0.5), Some((map.min(rod), map.max(rod))));
        assert_eq!(hit(0.0), None);
        let outside = [20u32, 0, 0];
        let cells =
            |f: unsafe extern "C" fn(_, _, _, _) -> _, c: &[u32; 3]| f(r, map, c.as_ptr(), 1);
        assert_eq!(cells(lw_robot_set_cells, &outside), LwStatus::OutOfRange);
        assert_eq!(cells(lw_robot_free_cells, &outside), LwStatus::OutOfRange);
        assert_eq!(lw_robot_clear_cells(r, cloud), LwStatus::Foreign);
        assert_eq!(cells(lw_robot_free_cells, &over), ok);
        assert_eq!(hit(0.5), None);
        assert_eq!(cells(lw_robot_set_cells, &over), ok);
        assert_eq!(hit(0.5), Some((map.min(rod), map.max(rod))));
        assert_eq!(lw_robot_clear_cells(r, map), ok);
        assert_eq!(hit(0.5), None);
        lw_robot_free(r);
        lw_model_free(m);
        lw_builder_free(b);
    }
}
