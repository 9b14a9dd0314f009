//! The blueprint of the viewer: the scene on the left, plots on the right.
//!
//! It is written as blueprint archetypes with fixed ids, because the SDK's builder cannot set the eye.
use crate::scene::Scene;
use linkwork_spatial::Vec3;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};
use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend,
    SpatialInformation, TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents,
    ViewportBlueprint,
};
use re_sdk_types::blueprint::components::{
    AutoLayout, AutoViews, BackgroundKind, ColumnShare, ContainerKind, IncludedContent, PanelState,
    PlayState, QueryExpression, RootContainer, TimelineName, ViewClass,
};
use re_sdk_types::components::{Name, TransformFrameId};
use re_sdk_types::datatypes::{TimeRange, TimeRangeBoundary};
use uuid::Uuid;

fn id(what: &str) -> Uuid {
    Uuid::new_v5(&Uuid::NAMESPACE_OID, what.as_bytes())
}

fn view(
    rec: &RecordingStream,
    class: &'static str,
    name: &str,
    origin: &str,
    contents: &[String],
) -> RecordingStreamResult<String> {
    let path = format!("view/{}", id(name));
    let queries = contents.iter().map(|c| QueryExpression(c.clone().into()));
    rec.log(format!("{path}/ViewContents"), &ViewContents::new(queries))?;
    let arch = ViewBlueprint::new(ViewClass(class.into()))
        .with_display_name(Name(name.into()))
        .with_space_origin(origin.to_string());
    rec.log(path.as_str(), &arch)?;
    Ok(path)
}

fn container(
    rec: &RecordingStream,
    kind: ContainerKind,
    name: &str,
    contents: &[String],
    shares: Option<Vec<f32>>,
) -> RecordingStreamResult<String> {
    let path = format!("container/{}", id(name));
    let mut arch = ContainerBlueprint::new(kind)
        .with_contents(contents.iter().map(|c| IncludedContent(c.clone().into())));
    if let Some(shares) = shares {
        arch = arch.with_col_shares(shares.into_iter().map(|s| ColumnShare(s.into())));
    }
    rec.log(path.as_str(), &arch)?;
    Ok(path)
}

/// Default colour of the sky.
const SKY: [u8; 4] = [22, 24, 30, 255];

/// Returns the 3D view of the frame `origin`, at whose origin the eye looks. It hides the viewer's grid, which would intersect the ground or look
/// like ground where there is none.
fn space(
    bp: &RecordingStream,
    scene: &Scene,
    origin: &EntityPath,
) -> RecordingStreamResult<String> {
    let all = ["+ /**".to_string(), "- /plots/**".to_string()];
    let path = view(bp, "3D", "Scene", &origin.to_string(), &all)?;
    let e = scene.eye.unwrap_or_else(|| Vec3::new(-4.0, -5.0, 3.0));
    let f3 = |v: &Vec3| [v.x as f32, v.y as f32, v.z as f32];
    let eye = EyeControls3D::new()
        .with_position(f3(&e))
        .with_look_target([0.0; 3])
        .with_eye_up([0.0, 0.0, 1.0]);
    bp.log(format!("{path}/EyeControls3D"), &eye)?;
    let frame = SpatialInformation::new(TransformFrameId::from_entity_path(origin));
    bp.log(format!("{path}/SpatialInformation"), &frame)?;
    bp.log(format!("{path}/LineGrid3D"), &LineGrid3D::new().with_visible(false))?;
    let [r, g, b, a] = scene.sky.unwrap_or(SKY);
    let sky = re_sdk_types::components::Color::from_unmultiplied_rgba(r, g, b, a);
    let background = Background::new(BackgroundKind::SolidColor).with_color(sky);
    bp.log(format!("{path}/Background"), &background)?;
    Ok(path)
}

/// Sends the blueprint of a scene: the 3D view from the frame `origin`, if the scene is not empty, and a panel for each of the `cameras` and each
/// panel of curves.
pub fn send(
    rec: &RecordingStream,
    scene: &Scene,
    origin: Option<&EntityPath>,
    cameras: &[String],
) -> RecordingStreamResult<()> {
    let application =
        rec.store_info().map_or_else(|| "linkwork".into(), |info| info.application_id().clone());
    let (bp, storage) = RecordingStreamBuilder::new(application)
        .recording_id(id(&scene.title).to_string())
        .blueprint()
        .memory()?;
    bp.set_time_sequence("blueprint", 0);
    let space = origin.map(|origin| space(&bp, scene, origin)).transpose()?;
    let mut plots = Vec::new();
    for camera in cameras {
        let place = crate::pictures::place(camera).to_string();
        plots.push(view(&bp, "2D", camera, &place, &["$origin/**".to_string()])?);
    }
    let whole = TimeRange { start: TimeRangeBoundary::Infinite, end: TimeRangeBoundary::Infinite };
    for panel in &scene.panels {
        let origin = plot_path(&panel.title);
        let contents = ["$origin/**".to_string()];
        let path = view(&bp, "TimeSeries", &panel.title, &origin, &contents)?;
        bp.log(
            format!("{path}/PlotLegend"),
            &PlotLegend::new().with_visible(panel.series.len() > 1),
        )?;
        // Show the whole run: by default a viewer that follows the run would show only the last half minute.
        bp.log(format!("{path}/TimeAxis"), &TimeAxis::new().with_view_range(whole))?;
        plots.push(path);
    }
    let root = match space {
        Some(space) if plots.is_empty() => {
            container(&bp, ContainerKind::Tabs, "root", &[space], None)?
        }
        Some(space) => {
            let right = container(&bp, ContainerKind::Vertical, "plots", &plots, None)?;
            let shares = Some(vec![3.0, 2.0]);
            container(&bp, ContainerKind::Horizontal, "root", &[space, right], shares)?
        }
        None => container(&bp, ContainerKind::Vertical, "root", &plots, None)?,
    };
    let root = root.trim_start_matches("container/").to_string();
    let root = Uuid::parse_str(&root).unwrap_or_default();
    bp.log(
        "viewport",
        &ViewportBlueprint::new()
            .with_root_container(RootContainer(root.into()))
            .with_auto_layout(AutoLayout(false.into()))
            .with_auto_views(AutoViews(false.into())),
    )?;
    let collapsed = PanelBlueprint::new().with_state(PanelState::Collapsed);
    bp.log("blueprint_panel", &collapsed)?;
    bp.log("selection_panel", &collapsed)?;
    bp.log(
        "time_panel",
        &TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(TimelineName("sim_time".into()))
            .with_play_state(PlayState::Following),
    )?;
    let messages = storage.take();
    let Some(first) = messages.first() else { return Ok(()) };
    let activation = re_sdk::external::re_log_types::BlueprintActivationCommand {
        blueprint_id: first.store_id().clone(),
        make_active: true,
        make_default: true,
    };
    rec.send_blueprint(messages, activation);
    Ok(())
}

/// Returns the entity path of a panel's curves.
pub fn plot_path(title: &str) -> String {
    let clean: String = title.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    format!("/plots/{}", clean.trim_matches('_'))
}
