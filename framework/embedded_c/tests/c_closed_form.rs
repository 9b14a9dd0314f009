//! Closed forms through the C interface: results bit-identical with Rust, errors as codes.

use linkwork_embedded::formats::{ReadOptions, Root, read_text};
use linkwork_embedded::spatial::{Pose, Quat, Vec3};
use linkwork_embedded::*;
use linkwork_robot::*;
use std::ffi::{CStr, CString};
use std::fmt::Write;
use std::ptr::null_mut;

/// A chain of hinges: axis, and offset from the previous one.
fn urdf(hinges: &[(&str, &str)]) -> CString {
    let mut text = String::from("<robot name='r'><link name='link0'/>");
    for (i, (axis, offset)) in hinges.iter().enumerate() {
        let k = i + 1;
        let joint = format!(
            "<joint name='joint{k}' type='revolute'><parent link='link{i}'/><child link='link{k}'/>"
        );
        let limit = "<limit lower='-3' upper='3' effort='100' velocity='9'/>";
        write!(text, "<link name='link{k}'/>{joint}<origin xyz='{offset}'/><axis xyz='{axis}'/>{limit}</joint>").unwrap();
    }
    CString::new(text + "</robot>").unwrap()
}

const SHOULDER: [(&str, &str); 2] = [("0 0 1", "0 0 0.3"), ("0 1 0", "0 0 0")];
const WRIST: [(&str, &str); 3] = [("1 0 0", "0.3 0 0.1"), ("0 1 0", "0 0 0"), ("1 0 0", "0 0 0")];
const ELBOW: (&str, &str) = ("0 1 0", "0.4 0 0");

unsafe fn robot_of(text: &CStr, tip: &CStr) -> *mut LwRobot {
    let (mut b, mut m, mut r) = (null_mut(), null_mut(), null_mut());
    // SAFETY: valid handles of the library, zero-terminated texts.
    unsafe {
        assert_eq!(lw_builder_new(&mut b), LwStatus::Ok);
        assert_eq!(lw_builder_robot_text(b, text.as_ptr(), LW_ROOT_FIXED, 0), LwStatus::Ok);
        let chain = lw_builder_chain(b, c"arm".as_ptr(), c"link0".as_ptr(), tip.as_ptr());
        assert_eq!(chain, LwStatus::Ok);
        assert_eq!(lw_builder_model(b, &mut m), LwStatus::Ok);
        assert_eq!(lw_robot_new(m, &mut r), LwStatus::Ok);
        lw_model_free(m);
        lw_builder_free(b);
    }
    r
}

fn in_rust(text: &CStr, tip: &str, held: Option<usize>, goal: &Goal, q: &[f64]) -> Vec<f64> {
    let options = ReadOptions { root: Root::Fixed, ..ReadOptions::default() };
    let d = read_text(text.to_str().unwrap(), &options).unwrap();
    let mut spec = ModelSpec::from_description(&d).unwrap();
    spec.parts.push(PartSpec::chain("arm", "link0", tip));
    let model = RobotModel::new(&spec).unwrap();
    let closed = model.closed_form(model.part("arm").unwrap(), held).unwrap();
    let mut out = vec![0.0; ClosedForm::MOST * q.len()];
    let count = Robot::new(&model)
        .inverse_kinematics_all(&closed, goal, Frame::World, q, &mut out)
        .unwrap();
    out.truncate(count * q.len());
    out
}

#[test]
fn all_solutions_in_c_are_those_in_rust() {
    let six = [&SHOULDER[..], &[ELBOW], &WRIST].concat();
    let seven = [&SHOULDER[..], &[("0 0 1", "0 0 0"), ("0 1 0", "0.02 0 0.4")], &WRIST].concat();
    let q4 = Quat::from_euler_angles(0.4, -0.3, 0.9).coords;
    // The C interface normalizes quaternions.
    let turn = Quat::from_quaternion(q4.into());
    let at = Vec3::new(0.35, 0.2, 0.5);
    let goal = Goal::pose(Pose::new(turn, at));
    let pose = LwPose { position: at.into(), quaternion: [q4.x, q4.y, q4.z, q4.w] };
    let parts = LW_GOAL_POSITION | LW_GOAL_ORIENTATION;
    let (none, weights) = ([0.0; 3], [1.0; 2]);
    let (direction, axis, towards, within) = (none, none, none, 0.0);
    let asked = LwGoal { pose, weights, parts, direction, axis, towards, within };
    for (hinges, tip, held) in
        [(&six, c"link6", None), (&seven, c"link7", None), (&seven, c"link7", Some(2))]
    {
        let text = urdf(hinges);
        let n = hinges.len();
        let q = vec![0.1; n];
        let wanted = in_rust(&text, tip.to_str().unwrap(), held, &goal, &q);
        assert!(wanted.len() >= 2 * n, "{}", wanted.len());
        let mut out = vec![0.0; 8 * n];
        let mut count = 0;
        // SAFETY: valid handles of the library, arrays of the lengths given.
        unsafe {
            let r = robot_of(&text, tip);
            let mut ask = |held: i64, goal: &LwGoal, q: &[f64], rows: usize| {
                lw_robot_inverse_kinematics_all(
                    r,
                    0,
                    held,
                    goal,
                    q.as_ptr(),
                    q.len(),
                    out.as_mut_ptr(),
                    rows,
                    &mut count,
                )
            };
            let place = held.map_or(-1, |k| k as i64);
            let mut status = LwStatus::Panicked;
            let counted = allocation_counter::measure(|| status = ask(place, &asked, &q, 8));
            assert_eq!((status, counted.count_total), (LwStatus::Ok, 0));
            assert_eq!(ask(place, &asked, &q, 1), LwStatus::NoRoom);
            assert_eq!(
                ask(place, &LwGoal { parts: LW_GOAL_POSITION, ..asked }, &q, 8),
                LwStatus::OutOfRange
            );
            assert_eq!(ask(place, &asked, &q[1..], 8), LwStatus::Length);
            for none in [-2, 9] {
                assert_eq!(ask(none, &asked, &q, 8), LwStatus::NoClosedForm);
            }
            if n == 6 {
                assert_eq!(ask(0, &asked, &q, 8), LwStatus::NoClosedForm);
            }
            assert_eq!(ask(place, &asked, &q, 8), LwStatus::Ok);
            lw_robot_free(r);
        }
        assert_eq!(
            out[..count * n].iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
            wanted.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        );
    }
    // Two hinges do not have a closed form.
    // SAFETY: as above.
    unsafe {
        let r = robot_of(&urdf(&SHOULDER), c"link2");
        let (q, mut out, mut count) = ([0.0; 2], [0.0; 16], 0);
        let status = lw_robot_inverse_kinematics_all(
            r,
            0,
            -1,
            &asked,
            q.as_ptr(),
            2,
            out.as_mut_ptr(),
            8,
            &mut count,
        );
        assert_eq!(status, LwStatus::NoClosedForm);
        let mut text = [0; 400];
        assert_eq!(lw_robot_message(r, text.as_mut_ptr(), 400, null_mut()), LwStatus::Ok);
        let said = CStr::from_ptr(text.as_ptr()).to_str().unwrap();
        assert!(said.contains("neither six nor seven"), "{said}");
        lw_robot_free(r);
    }
}
