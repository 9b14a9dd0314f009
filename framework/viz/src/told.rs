//! What is drawn beside a simulation and is none of its own: bodies and curves that somebody else tells.
//!
//! A table of a flight has poses and numbers that no plan knows. They get entities and columns after those of the
//! plans, so that a [`Player`](crate::Player) takes them by name like all others; a run never fills them.
use crate::layout::plot_path;
use crate::scene::Panel;
use crate::shapes::entity;
use crate::viewer::View;
use re_sdk::EntityPath;

/// Bodies and curves beside those of a simulation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
    /// Names of the bodies, none of them a body of the simulation. Each leaves a trail; shapes on them are among
    /// those of the scene.
    pub bodies: Vec<String>,
    /// Panels of curves: the variables of the series are names by which values are told.
    pub panels: Vec<Panel>,
}

impl View {
    /// The view with bodies and curves beside it.
    #[must_use]
    pub fn with(mut self, told: &Told) -> View {
        // Bodies stand before nodes.
        let first = self.bodies.len();
        for (k, name) in told.bodies.iter().enumerate() {
            self.entities.insert(first + k, entity(name));
            self.bodies.push(name.clone());
            self.trails.push((first + k, true));
        }
        for phase in self.phases.iter_mut().flatten() {
            phase.bodies.resize(self.bodies.len(), None);
        }
        for panel in &told.panels {
            for (label, name, shown) in &panel.series {
                let path = EntityPath::from(plot_path(&panel.title))
                    .join(&EntityPath::from_single_string(label.clone()));
                self.curves.push((path, label.clone(), self.columns.len(), *shown));
                self.columns.push(name.clone());
            }
        }
        self.scene.panels.extend(told.panels.iter().cloned());
        self
    }
}
