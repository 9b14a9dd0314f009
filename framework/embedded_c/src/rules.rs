//! Collision rules: which pairs are checked.

use crate::builder::LwBuilder;
use crate::edge::{alone, numbers, text};
use crate::status::{Fault, LwStatus};
use linkwork_embedded::Neighbours;
use std::ffi::c_char;

/// Bodies that a hinge joins are not checked against each other, except for pairs of `lw_builder_collide`. This is the default.
pub const LW_NEIGHBOURS_PASS: u32 = 0;
/// Bodies that a hinge joins are checked against each other.
pub const LW_NEIGHBOURS_COLLIDE: u32 = 1;

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn pair(a: *const c_char, b: *const c_char) -> Result<[String; 2], Fault> {
    // SAFETY: guaranteed by the caller.
    unsafe { Ok([text("a", a)?.to_owned(), text("b", b)?.to_owned()]) }
}

/// Excludes a pair from collision checks. Each is the name of a collider, or of a body for all its colliders.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_ignore(
    builder: *mut LwBuilder,
    a: *const c_char,
    b: *const c_char,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(builder, LwBuilder::parts, |d| {
            d.spec.rules.ignore.push(pair(a, b)?);
            Ok(())
        })
    }
}

/// Includes a pair in collision checks although a hinge joins them or they are in the same group of `lw_builder_apart`. `lw_builder_ignore` takes
/// precedence. Names as there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_collide(
    builder: *mut LwBuilder,
    a: *const c_char,
    b: *const c_char,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(builder, LwBuilder::parts, |d| {
            d.spec.rules.collide.push(pair(a, b)?);
            Ok(())
        })
    }
}

/// Adds a group of `n` bodies, by name, that are not checked against each other.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_apart(
    builder: *mut LwBuilder,
    bodies: *const *const c_char,
    n: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
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

/// Selects the rule for bodies that a hinge with fewer than six degrees of freedom joins: one of `LW_NEIGHBOURS_...`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_neighbours(
    builder: *mut LwBuilder,
    neighbours: u32,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
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
