//! Additional bodies and curves from external data, which are drawn together with a simulation.
//!
//! A table of a flight contains poses and numbers that no plan contains. They get entities and columns after those of the plans, so a
//! [`Player`](crate::Player) finds them by name like all others. A run never fills them.
use crate::layout::plot_path;
use crate::scene::Panel;
use crate::shapes::entity;
use crate::viewer::View;
use re_sdk::EntityPath;

/// Bodies and curves in addition to those of a simulation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExternalData {
    /// Names of the bodies, which must differ from those of the simulation. Each has a trail. Shapes on them are among the shapes of the scene.
    pub bodies: Vec<String>,
    /// Panels of curves. The variables of the series are the names of the external values.
    pub panels: Vec<Panel>,
}

impl View {
    /// Returns the view with additional bodies and curves.
    #[must_use]
    pub fn with(mut self, told: &ExternalData) -> View {
        // Bodies come before nodes.
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
