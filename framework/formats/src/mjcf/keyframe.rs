//! Keyframes of an MJCF file; one of them may be the start.

use super::Mj;
use crate::error::FaultKind;
use crate::read::Cx;
use crate::xml::Element;
use crate::{Description, Initial};
use linkwork_multibody::SubhingeKind;
use std::collections::BTreeMap;

impl<'e> Mj<'e> {
    /// Uses the keyframe in the options as the start; without it, lists the keyframes.
    pub(super) fn keyframes(&self, cx: &mut Cx<'_>, root: &'e Element, d: &mut Description) {
        let mut keys: BTreeMap<String, &Element> = BTreeMap::new();
        let all = root.all("keyframe").flat_map(|list| list.all("key"));
        for (k, e) in all.enumerate() {
            let name = e.attr("name").map_or(k.to_string(), str::to_owned);
            e.attr("qpos");
            keys.insert(name, e);
        }
        let Some(wanted) = cx.options.keyframe.clone() else {
            if let (Some(first), Some(e)) = (keys.keys().next(), keys.values().next()) {
                keys.values().for_each(|e| e.touch_all());
                let names: Vec<&str> = keys.keys().take(10).map(String::as_str).collect();
                let note = format!(
                    "keyframes {}: the start is the reference configuration; `keyframe: \"{first}\"` starts there",
                    names.join(", ")
                );
                cx.ignored.push(e.ignored("mujoco/keyframe", note));
            }
            return;
        };
        let Some(e) = keys.get(&wanted) else {
            let names = keys.keys().map(String::as_str);
            cx.unknown(root.place(), "the option `keyframe`", "keyframe", &wanted, names);
            return;
        };
        keys.iter().filter(|(name, _)| **name != wanted).for_each(|(_, e)| e.touch_all());
        self.start(cx, e, &format!("keyframe `{wanted}`"), d);
    }

    fn start(&self, cx: &mut Cx<'_>, e: &Element, what: &str, d: &mut Description) {
        let Some(text) = e.attr("qpos") else { return };
        let joints: BTreeMap<&str, _> = d.joints.iter().map(|j| (j.name.as_str(), j)).collect();
        let bodies: BTreeMap<&str, _> =
            d.builder.bodies().iter().map(|b| (b.name.as_str(), b)).collect();
        // In MuJoCo's coordinates, joints are in the order of the file, and quaternions have w
        // first.
        let mut starts: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let mut places: Vec<(&str, usize)> = Vec::new();
        // A keyframe of an attached model has a list of its joints.
        let attached: Option<Vec<String>> = (e.scope != 0)
            .then(|| e.attr("joints").unwrap_or_default().split('\n').map(str::to_owned).collect());
        for name in attached.as_ref().unwrap_or(&self.joint_order) {
            let Some(j) = joints.get(name.as_str()) else { continue };
            let Some(body) = bodies.get(j.body.as_str()) else { continue };
            let chain = &body.hinge.subhinges;
            let nq = |k: &SubhingeKind| k.nq();
            let before: usize = chain.iter().take(j.subhinge).map(|s| nq(&s.kind)).sum();
            let own: usize = chain.iter().skip(j.subhinge).take(j.count).map(|s| nq(&s.kind)).sum();
            // Joints that are not in the list keep the reference configuration.
            let reference = || {
                let own = d.initial.iter().find(|i| i.body == j.body).map(|i| i.q.clone());
                own.unwrap_or_else(|| {
                    let neutral = |k: &SubhingeKind| {
                        let mut q = vec![0.0; nq(k)];
                        if let (Some(w), 4..) = (q.last_mut(), nq(k)) {
                            *w = 1.0;
                        }
                        q
                    };
                    chain.iter().flat_map(|s| neutral(&s.kind)).collect()
                })
            };
            starts.entry(j.body.clone()).or_insert_with(reference);
            let order: &[usize] = match own {
                4 => &[3, 0, 1, 2],
                7 => &[0, 1, 2, 6, 3, 4, 5],
                _ => &[0],
            };
            places.extend(order.iter().map(|k| (j.body.as_str(), before + k)));
        }
        let what = format!("{what}: `qpos`");
        let count = places.len()..=places.len();
        let Some(list) = cx.parse_list(e.place_of("qpos"), text, &what, count) else { return };
        for ((body, at), x) in places.into_iter().zip(list) {
            if let Some(q) = starts.get_mut(body) {
                q[at] = x;
            }
        }
        for (body, q) in &mut starts {
            let mut at = 0;
            for s in &bodies[body.as_str()].hinge.subhinges {
                let n = s.kind.nq();
                if n >= 4 {
                    let turn = &mut q[at + n - 4..at + n];
                    let norm = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
                    if !(norm > 1e-100) {
                        let kind = FaultKind::Unsupported {
                            what: format!("{what}: the quaternion of `{body}` is zero"),
                            help: "write w x y z, for example 1 0 0 0".into(),
                        };
                        cx.fault(e.place_of("qpos"), kind);
                        return;
                    }
                    turn.iter_mut().for_each(|x| *x /= norm);
                }
                at += n;
            }
        }
        d.initial.retain(|i| !starts.contains_key(&i.body));
        d.initial.extend(starts.into_iter().map(|(body, q)| Initial { body, q }));
    }
}
