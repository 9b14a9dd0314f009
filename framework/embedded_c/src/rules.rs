//! Rules of collisions: which pairs meet.

use crate::builder::LwBuilder;
use crate::edge::{alone, numbers, text};
use crate::status::{Fault, LwStatus};
use linkwork_embedded::Neighbours;
use std::ffi::c_char;

/// Bodies that a hinge joins pass each other, except for pairs of `lw_builder_collide`: so it is at first.
pub const LW_NEIGHBOURS_PASS: u32 = 0;
/// They collide.
pub const LW_NEIGHBOURS_COLLIDE: u32 = 1;

/// # Safety
/// The promises at the head of the crate.
unsafe fn pair(a: *const c_char, b: *const c_char) -> Result<[String; 2], Fault> {
    // SAFETY: the caller's promises.
    unsafe { Ok([text("a", a)?.to_owned(), text("b", b)?.to_owned()]) }
}

/// Two that do not collide: each the name of a collider or of a body, which stands for all its colliders.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_ignore(
    builder: *mut LwBuilder,
    a: *const c_char,
    b: *const c_char,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(builder, LwBuilder::parts, |d| {
            d.spec.rules.ignore.push(pair(a, b)?);
            Ok(())
        })
    }
}

/// Two that collide though a hinge joins them or they are of one group of `lw_builder_apart`, as of `lw_builder_ignore`, which goes before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_collide(
    builder: *mut LwBuilder,
    a: *const c_char,
    b: *const c_char,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(builder, LwBuilder::parts, |d| {
            d.spec.rules.collide.push(pair(a, b)?);
            Ok(())
        })
    }
}

/// A group of `n` bodies, by name, of which none collides with another.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_apart(
    builder: *mut LwBuilder,
    bodies: *const *const c_char,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(builder, LwBuilder::parts, |d| {
            let mut group = Vec::new();
            for body in numbers("bodies", bodies, n, n)? {
                group.push(text("bodies", *body)?.to_owned());
            }
            d.spec.rules.apart.push(group);
            Ok(())
        })
    }
}

/// What happens between bodies that a hinge of fewer than six degrees of freedom joins: one of `LW_NEIGHBOURS_...`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_neighbours(
    builder: *mut LwBuilder,
    neighbours: u32,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(builder, LwBuilder::parts, |d| {
            d.spec.rules.neighbours = match neighbours {
                LW_NEIGHBOURS_PASS => Neighbours::Pass,
                LW_NEIGHBOURS_COLLIDE => Neighbours::Collide,
                value => {
                    let help = "one of LW_NEIGHBOURS_..";
                    return Err(Fault::Choice { what: "neighbours", value, help });
                }
            };
            Ok(())
        })
    }
}
