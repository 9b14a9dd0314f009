//! Several tips of a robot with two arms at once through the C interface: results bit-identical with Rust, no allocation, errors as codes.

use crate::support::*;
use linkwork_embedded::spatial::{Pose, Quat};
use linkwork_embedded::*;
use linkwork_robot::*;
use std::ptr::{null, null_mut};

const NOWHERE: LwGoal = LwGoal {
    pose: LwPose { position: [0.0; 3], quaternion: [0.0, 0.0, 0.0, 1.0] },
    weights: [1.0; 2],
    parts: 0,
    direction: [0.0; 3],
    axis: [0.0; 3],
    towards: [0.0; 3],
    within: 0.0,
};

/// Both tips at once, one relative to the other, objects in both hands, null-space objectives, portions, bounds, and errors.
#[test]
fn several_tips_at_once() {
    let mut two = Two::new();
    let r = two.r;
    let effort = LwEffort { tolerances: [1e-9; 2], steps: 100, restarts: 8, kinematics: 9000 };
    let own = Effort { tolerances: [1e-9; 2], steps: 100, restarts: 8, kinematics: 9000 };
    // SAFETY: valid handles of the library, arrays of the lengths given.
    unsafe {
        let mut s = null_mut();
        assert_eq!(lw_whole_body_ik_new(r, 2, &mut s), LwStatus::Ok);
        let mut search = WholeBodyIk::new(&two.robot, 2);
        let mut answer = std::mem::zeroed::<LwAnswer>();
        let mut best = std::mem::zeroed::<LwBest>();
        two.go(&Q);
        // Normalize like the C interface.
        let unit = |X: Pose| Pose::new(Quat::new_normalize(*X.rotation.quaternion()), X.position);
        let near = |X: Pose| unit(Pose::new(X.rotation, X.position * 0.97));
        let X = [two.left, two.right].map(|p| near(two.robot.tip_pose(p).unwrap()));
        let of = |X: Pose, parts| LwGoal { pose: X.into(), parts, ..NOWHERE };
        let both = LW_GOAL_POSITION | LW_GOAL_ORIENTATION;
        let between = unit(X[0].inverse() * X[1]);
        let base = two.robot.base_pose(two.left).unwrap().inverse() * X[0];
        let apart = TipGoal::new(two.right, Goal::pose(between)).seen_from(Frame::Tip(two.left));
        let cases = [
            (
                LwTipGoal { goal: of(X[0], both), part: LEFT, seen_from: LW_NO_PART },
                LwTipGoal { goal: of(between, both), part: RIGHT, seen_from: LEFT },
                [TipGoal::new(two.left, Goal::pose(X[0])), apart],
            ),
            (
                LwTipGoal {
                    goal: of(base, LW_GOAL_POSITION | LW_GOAL_IN_BASE),
                    part: LEFT,
                    seen_from: LW_NO_PART,
                },
                LwTipGoal { goal: of(X[1], LW_GOAL_POSITION), part: RIGHT, seen_from: LW_NO_PART },
                [
                    TipGoal::new(two.left, Goal::position(base.position)).seen_from(Frame::Base),
                    TipGoal::new(two.right, Goal::position(X[1].position)),
                ],
            ),
        ];
        let (likes, prefer) = likes(2);
        for (a, b, rust) in cases {
            let (goals, mut left) = ([a, b], [9.0; 4]);
            let (mut q, mut theirs) = (Q, Q);
            let (g, p, l) = (goals.as_ptr(), q.as_mut_ptr(), left.as_mut_ptr());
            quiet(|| lw_whole_body_ik_solve(r, s, g, 2, &effort, p, 13, l, 4, &mut answer));
            let told = search.solve(&two.robot, &rust, &own, &mut theirs).unwrap();
            assert_eq!((answer, answer.outcome), (LwAnswer::from(told), LwOutcome::Met));
            same(&q, &theirs);
            let residuals: Vec<f64> =
                search.residuals().iter().flat_map(|r| [r.position, r.orientation]).collect();
            assert_eq!(bits(&left), bits(&residuals));
            // Search in portions, starting with zero evaluations.
            let mut q = Q;
            let p = q.as_mut_ptr();
            let none = LwEffort { kinematics: 0, ..effort };
            quiet(|| lw_whole_body_ik_solve(r, s, g, 2, &none, p, 13, null_mut(), 0, &mut answer));
            while answer.outcome == LwOutcome::Unfinished {
                quiet(|| lw_whole_body_ik_resume(r, s, 2, p, 13, l, 4, &mut answer));
            }
            assert_eq!(answer, LwAnswer::from(told));
            same(&q, &theirs);
            assert_eq!(bits(&left), bits(&residuals));
            let (mut q, mut theirs) = (Q, Q);
            let p = q.as_mut_ptr();
            quiet(|| lw_whole_body_ik_best(r, s, g, 2, &likes, &effort, p, 13, &mut best));
            let told = search.best(&mut two.robot, &rust, &prefer, &own, &mut theirs).unwrap();
            same(&q, &theirs);
            same(&[best.cost], &[told.cost]);
            assert_eq!((best.solutions, best.kinematics), (told.solutions, told.kinematics));
            let mut steps = 0;
            quiet(|| lw_whole_body_ik_worst_case_steps(r, s, g, 2, &effort, &mut steps));
            assert_eq!(steps, search.worst_case_steps(&rust, &own));
        }
        // If the right arm is kept, the torso (which is not a part) and the left arm stay. Afterwards they move again.
        let (goal, rust) = (cases[1].0, cases[1].2);
        quiet(|| lw_whole_body_ik_keep(r, s, RIGHT));
        let mut q = Q;
        let p = q.as_mut_ptr();
        quiet(|| {
            lw_whole_body_ik_solve(r, s, &goal, 1, &effort, p, 13, null_mut(), 0, &mut answer)
        });
        search.keep(two.model.dofs(two.right).unwrap()).unwrap();
        let mut theirs = Q;
        search.solve(&two.robot, &rust[..1], &own, &mut theirs).unwrap();
        same(&q, &theirs);
        assert!(two.model.dofs(two.right).unwrap().iter().all(|d| q[*d] == Q[*d]));
        quiet(|| lw_whole_body_ik_release(r, s, RIGHT));
        search.release(two.model.dofs(two.right).unwrap()).unwrap();
        // Both hands are on the beam. The nearest solution keeps them there; if everything except one wrist is kept,
        // such a solution does not exist.
        for hand in [LEFT, RIGHT] {
            assert_eq!(lw_robot_grasp(r, hand, two.beam.index() as u32, null()), LwStatus::Ok);
        }
        for hand in [two.left, two.right] {
            two.robot.grasp(hand, two.beam, Grasp::Here).unwrap();
        }
        let far = Pose::translation(2.5, 0.0, 0.5);
        let goal = LwTipGoal { goal: of(far, LW_GOAL_POSITION), part: LEFT, seen_from: LW_NO_PART };
        let rust = [TipGoal::new(two.left, Goal::position(far.position))];
        let (mut q, mut theirs) = (Q, Q);
        let p = q.as_mut_ptr();
        quiet(|| lw_whole_body_ik_solve(r, s, &goal, 1, null(), p, 13, null_mut(), 0, &mut answer));
        let told = search.solve(&two.robot, &rust, &Effort::default(), &mut theirs).unwrap();
        assert_eq!((answer, answer.outcome), (LwAnswer::from(told), LwOutcome::Nearest));
        same(&q, &theirs);
        for part in [LEFT, RIGHT] {
            assert_eq!(lw_whole_body_ik_keep(r, s, part), LwStatus::Ok);
        }
        let mut q = Q;
        q[3] += 0.2;
        let opened = q;
        let p = q.as_mut_ptr();
        let open =
            lw_whole_body_ik_solve(r, s, null(), 0, &effort, p, 13, null_mut(), 0, &mut answer);
        two.refused(open, LwStatus::DoesNotClose, "the grasp of object 0 by two hands");
        assert!(answer.position > 0.01 && answer.outcome == LwOutcome::Nearest, "{answer:?}");
        // A rejected call does not write anything.
        q = opened;
        let (goals, mut left) = ([cases[0].0, cases[0].1], [9.0; 4]);
        let p = q.as_mut_ptr();
        let l = left.as_mut_ptr();
        let mut ask = |g: &[LwTipGoal], n, m| {
            lw_whole_body_ik_solve(r, s, g.as_ptr(), g.len(), &effort, p, n, l, m, &mut answer)
        };
        two.refused(ask(&[goals[0]; 3], 13, 6), LwStatus::NoRoom, "3 goals");
        two.refused(ask(&goals, 12, 4), LwStatus::Length, "`q`");
        two.refused(ask(&goals, 13, 3), LwStatus::Length, "`residuals`");
        let itself = LwTipGoal { seen_from: RIGHT, ..goals[1] };
        two.refused(ask(&[itself], 13, 2), LwStatus::OutOfRange, "tip relative to itself");
        let lost = LwTipGoal { seen_from: 9, ..goals[1] };
        two.refused(ask(&[lost], 13, 2), LwStatus::Foreign, "");
        let two_frames = LwTipGoal { seen_from: RIGHT, ..cases[1].0 };
        two.refused(ask(&[two_frames], 13, 2), LwStatus::OutOfRange, "LW_NO_PART");
        let nothing = LwTipGoal { goal: NOWHERE, ..goals[0] };
        two.refused(ask(&[nothing], 13, 2), LwStatus::OutOfRange, "give a position");
        two.refused(lw_whole_body_ik_keep(r, s, 9), LwStatus::Foreign, "");
        let over = lw_whole_body_ik_resume(r, s, 9, p, 13, p.add(12), 4, &mut answer);
        two.refused(over, LwStatus::Overlap, "`q` and `residuals`");
        assert_eq!(lw_whole_body_ik_keep(r, s, LEFT), LwStatus::Ok);
        let ended = lw_whole_body_ik_resume(r, s, 9, p, 13, null_mut(), 0, &mut answer);
        two.refused(ended, LwStatus::NoSearch, "");
        let mut none = null_mut();
        two.refused(lw_whole_body_ik_new(r, 1 << 20, &mut none), LwStatus::OutOfRange, "`goals`");
        let (g, a, mut steps) = (goals.as_ptr(), &raw mut answer, 0);
        all_null(&[
            lw_whole_body_ik_new(r, 2, null_mut()),
            lw_whole_body_ik_new(null_mut(), 2, &mut none),
            lw_whole_body_ik_keep(r, null_mut(), LEFT),
            lw_whole_body_ik_release(r, null_mut(), LEFT),
            lw_whole_body_ik_solve(r, null_mut(), g, 2, null(), p, 13, l, 4, a),
            lw_whole_body_ik_solve(r, s, null(), 2, null(), p, 13, l, 4, a),
            lw_whole_body_ik_solve(r, s, g, 2, null(), null_mut(), 13, l, 4, a),
            lw_whole_body_ik_solve(r, s, g, 2, null(), p, 13, null_mut(), 4, a),
            lw_whole_body_ik_solve(r, s, g, 2, null(), p, 13, l, 4, null_mut()),
            lw_whole_body_ik_resume(r, s, 9, p, 13, l, 0, null_mut()),
            lw_whole_body_ik_best(r, s, g, 2, null(), null(), p, 13, &mut best),
            lw_whole_body_ik_best(r, s, g, 2, &likes, null(), p, 13, null_mut()),
            lw_whole_body_ik_worst_case_steps(r, s, g, 2, null(), null_mut()),
            lw_whole_body_ik_worst_case_steps(r, s, null(), 2, null(), &mut steps),
            lw_effort_worst_case_steps(null(), null(), &mut steps),
            lw_effort_worst_case_steps(null(), &goals[0].goal, null_mut()),
        ]);
        assert_eq!((q, left), (opened, [9.0; 4]), "nothing was written");
        assert_eq!(lw_effort_worst_case_steps(&effort, &goals[0].goal, &mut steps), LwStatus::Ok);
        assert_eq!(steps, own.worst_case_steps(&Goal::pose(X[0])));
        lw_whole_body_ik_free(s);
        lw_whole_body_ik_free(null_mut());
    }
}

/// An arm whose wrist mimics its elbow.
const LEVEL: &str = r#"<robot name="level"><link name="floor"/>{links}
  <joint name="turn" type="revolute"><parent link="floor"/><child link="turner"/><axis xyz="0 0 1"/>{limit}</joint>
  <joint name="lift" type="revolute"><parent link="turner"/><child link="upper"/><axis xyz="0 1 0"/>{limit}</joint>
  <joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>{limit}</joint>
  <joint name="wrist" type="revolute"><parent link="lower"/><child link="hand"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>{limit}
    <mimic joint="bend" multiplier="-1" offset="0.2"/></joint>
</robot>"#;

/// Joints that mimic others are rejected with the remedy, or kept coupled, bit-identical with Rust.
#[test]
fn joints_that_mimic_others_are_kept_coupled_when_asked() {
    let link = |n| {
        format!(
            "<link name='{n}'><inertial><mass value='1'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        )
    };
    let links: String = ["turner", "upper", "lower", "hand"].map(link).concat();
    let limit = "<limit lower='-2' upper='2' effort='9' velocity='1'/>";
    let text = LEVEL.replace("{links}", &links).replace("{limit}", limit);
    let options = formats::ReadOptions { root: formats::Root::Fixed, ..Default::default() };
    let mut spec = ModelSpec::with_closures(&formats::read_text(&text, &options).unwrap());
    spec.parts.push(PartSpec::chain("arm", "floor", "hand"));
    let model = RobotModel::new(&spec).unwrap();
    let rust = Robot::new(&model);
    let mut search = WholeBodyIk::new(&rust, 1);
    let text = std::ffi::CString::new(text).unwrap();
    // SAFETY: valid handles of the library, arrays of the lengths given.
    unsafe {
        let (mut b, mut m, mut r, mut s) = (null_mut(), null_mut(), null_mut(), null_mut());
        assert_eq!(lw_builder_new(&mut b), LwStatus::Ok);
        let read = |b| lw_builder_robot_text(b, text.as_ptr(), LW_ROOT_FIXED, 0);
        let said = |b: *mut LwBuilder| {
            let mut buffer = [0_u8; 400];
            let room = buffer.len();
            lw_builder_message(b, buffer.as_mut_ptr().cast(), room, null_mut());
            std::ffi::CStr::from_bytes_until_nul(&buffer).unwrap().to_string_lossy().into_owned()
        };
        assert_eq!(read(b), LwStatus::Model);
        assert!(said(b).contains("coupling") && said(b).contains("lw_builder_keep_closures"));
        assert_eq!(lw_builder_keep_closures(b), LwStatus::Ok);
        assert_eq!(read(b), LwStatus::Ok);
        assert_eq!(lw_builder_keep_closures(b), LwStatus::Model);
        assert!(said(b).contains("before lw_builder_robot_file"), "{}", said(b));
        assert_eq!(lw_builder_keep_closures(null_mut()), LwStatus::Null);
        let [name, base, tip] = [c"arm", c"floor", c"hand"].map(|t| t.as_ptr());
        assert_eq!(lw_builder_chain(b, name, base, tip), LwStatus::Ok);
        assert_eq!(lw_builder_model(b, &mut m), LwStatus::Ok);
        assert_eq!(lw_robot_new(m, &mut r), LwStatus::Ok);
        assert_eq!(lw_whole_body_ik_new(r, 1, &mut s), LwStatus::Ok);
        let mut answer = std::mem::zeroed::<LwAnswer>();
        for place in [[0.5, 0.3, -0.2], [0.1, 0.7, 0.3], [2.0, 0.3, 0.4]] {
            let pose = LwPose { position: place, ..NOWHERE.pose };
            let goal = LwGoal { pose, parts: LW_GOAL_POSITION, ..NOWHERE };
            let tips = LwTipGoal { goal, part: 0, seen_from: LW_NO_PART };
            let (mut q, mut theirs) = ([0.1; 4], [0.1; 4]);
            let p = q.as_mut_ptr();
            quiet(|| {
                lw_whole_body_ik_solve(r, s, &tips, 1, null(), p, 4, null_mut(), 0, &mut answer)
            });
            let arm = model.part("arm").unwrap();
            let own = [TipGoal::new(arm, Goal::position(place.into()))];
            let told = search.solve(&rust, &own, &Effort::default(), &mut theirs).unwrap();
            assert_eq!(answer, LwAnswer::from(told));
            same(&q, &theirs);
            assert_eq!(answer.outcome == LwOutcome::Met, place[0] < 1.0);
            assert!((q[3] + q[2] - 0.2).abs() < 1.1e-9, "the wrist mimics the elbow: {q:?}");
            // Moving the chain alone would violate the coupling.
            let alone = lw_robot_inverse_kinematics(r, 0, &goal, null(), p, 4, &mut answer);
            assert_eq!(alone, LwStatus::DoesNotClose);
        }
        lw_whole_body_ik_free(s);
        lw_robot_free(r);
        lw_model_free(m);
        lw_builder_free(b);
    }
}
