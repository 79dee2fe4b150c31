# SPDX-License-Identifier: MIT
"""User settings: the daemon in the preferences, the job in the scene; and their panels."""
from __future__ import annotations

from typing import Any, Optional

import bpy
from farlight.camera import usual_clamp
from farlight.messages import Denoise, Integrator, Tracer

from . import motion

ENGINE = "FARLIGHT"


def _choices(words: Any) -> list[tuple[str, str, str]]:
    return [(one.word, one.word, "") for one in words]


class FarlightPreferences(bpy.types.AddonPreferences):  # type: ignore[misc]
    """Preferences of the add-on."""
    bl_idname = __package__

    server: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Daemon", description="unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]; empty: FARLIGHT_SERVER, else one of Blender's own")
    key_file: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Key file", subtype="FILE_PATH", description="The daemon's key: the connection is sealed; empty: FARLIGHT_KEY over TCP")

    def draw(self, _: bpy.types.Context) -> None:
        """Draws the form."""
        self.layout.prop(self, "server")
        self.layout.prop(self, "key_file")


class FarlightSettings(bpy.types.PropertyGroup):  # type: ignore[misc]
    """Settings of a scene."""
    server: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Daemon", description="unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET] for this scene; empty: the preferences' one")
    integrator: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Integrator", items=_choices(Integrator), default="path", description="Method that traces light")
    tracer: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Tracer", items=_choices(Tracer), default="bvh", description="The acceleration structure")
    samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples", default=64, min=1, max=65536, description="Rays for each pixel; a multiple of the number of steps")
    step_samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples a step", default=16, min=1, max=4096, description="Samples between two updates of the picture")
    view_samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Viewport samples", default=32, min=1, max=4096, description="Samples in the viewport at rest")
    depth: bpy.props.IntProperty(name="Bounces", default=8, min=0, max=32)  # type: ignore[valid-type]
    use_auto_clamp: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Clamp by samples", default=True, description="Clamp indirect light at 10, below 64 samples at less, down to 1.25")
    clamp: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Clamp indirect", default=10, min=0, max=1e6, description="Brightest light of a path over several bounces; 0: no limit")
    denoise: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Denoise", items=_choices(Denoise), default="auto", description="auto: up to 64 samples")
    motion_steps: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Motion steps", default=16, min=1, max=256, description="Frames averaged for a picture with motion blur in which the camera or a "
        "light moves, at most one per sample; other things blur without steps")
    use_pass_albedo: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Denoising albedo", description="Base colours, as the pass Denoising Albedo")


def server_of(scene: bpy.types.Scene) -> tuple[Optional[str], Optional[str]]:
    """Address and key file."""
    addon = bpy.context.preferences.addons.get(__package__)
    preferences = addon.preferences if addon else None
    server = scene.farlight.server or (preferences.server if preferences else "")
    key_file = bpy.path.abspath(preferences.key_file) if preferences and preferences.key_file else ""
    return server or None, key_file or None


def clamp_of(chosen: FarlightSettings) -> float:
    """The clamp for F12 and for the viewport, which then has the same brightness."""
    return usual_clamp(chosen.samples) if chosen.use_auto_clamp else float(chosen.clamp)


class _Panel(bpy.types.Panel):  # type: ignore[misc]
    bl_space_type, bl_region_type = "PROPERTIES", "WINDOW"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """True if the panel is shown."""
        return bool(context.engine == ENGINE)

    def _rows(self, owner: Any, *names: str, is_active: bool = True) -> None:
        rows = self.layout.column()
        rows.use_property_split, rows.active = True, is_active
        for name in names:
            rows.prop(owner, name)


class FARLIGHT_PT_sampling(_Panel):  # pylint: disable=invalid-name
    """Panel in the render properties."""
    bl_label, bl_context = "Farlight", "render"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the form."""
        chosen = context.scene.farlight
        self._rows(chosen, "server", "integrator", "tracer", "samples", "step_samples", "view_samples", "depth", "use_auto_clamp")
        self._rows(chosen, "clamp", is_active=not chosen.use_auto_clamp)
        self._rows(chosen, "denoise")
        self._rows(context.scene.render, "film_transparent")


class FARLIGHT_PT_motion(_Panel):  # pylint: disable=invalid-name
    """Panel in the render properties."""
    bl_label, bl_context = "Motion Blur", "render"

    def draw_header(self, context: bpy.types.Context) -> None:
        """Draws the switch."""
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the form."""
        scene = context.scene
        self.layout.active = scene.render.use_motion_blur
        owner = motion.position_owner(scene)
        if owner is not None:
            self._rows(owner, "motion_blur_position")
        self._rows(scene.render, "motion_blur_shutter")
        self._rows(scene.farlight, "motion_steps")


class FARLIGHT_PT_passes(_Panel):  # pylint: disable=invalid-name
    """Panel in the view layer's properties."""
    bl_label, bl_context = "Passes", "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the form."""
        self._rows(context.view_layer, "use_pass_z", "use_pass_normal")
        self._rows(context.view_layer, "use_pass_vector", is_active=not motion.is_wanted(context.scene))
        self._rows(context.scene.farlight, "use_pass_albedo")


class FARLIGHT_PT_light_groups(_Panel):  # pylint: disable=invalid-name
    """Panel in the view layer's properties: the existing groups."""
    bl_label, bl_context = "Light Groups", "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the form."""
        layer, row = context.view_layer, self.layout.row()
        row.template_list("UI_UL_list", "lightgroups", layer, "lightgroups", layer, "active_lightgroup_index", rows=3)
        buttons = row.column(align=True)
        buttons.operator("scene.view_layer_add_lightgroup", icon="ADD", text="")
        buttons.operator("scene.view_layer_remove_lightgroup", icon="REMOVE", text="")


class _LightGroup(_Panel):
    bl_label = "Light Group"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the form."""
        owner = context.object if self.bl_context == "object" else context.world
        if owner is not None:
            self.layout.prop_search(owner, "lightgroup", context.view_layer, "lightgroups", results_are_suggestions=True)


class FARLIGHT_PT_group_of_object(_LightGroup):  # pylint: disable=invalid-name
    """Panel in an object's properties."""
    bl_context = "object"


class FARLIGHT_PT_group_of_world(_LightGroup):  # pylint: disable=invalid-name
    """Panel in the world's properties."""
    bl_context = "world"


_CLASSES = (FarlightPreferences, FarlightSettings, FARLIGHT_PT_sampling, FARLIGHT_PT_motion, FARLIGHT_PT_passes,
            FARLIGHT_PT_light_groups, FARLIGHT_PT_group_of_object, FARLIGHT_PT_group_of_world)


def _others() -> Any:
    """Blender's own panels for lights, materials, cameras and worlds that any engine may use."""
    left_out = {"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes"}
    for panel in bpy.types.Panel.__subclasses__():
        if "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ()) and panel.__name__ not in left_out:
            yield panel


def register() -> None:
    """Called when the add-on is enabled."""
    for one in _CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.farlight = bpy.props.PointerProperty(type=FarlightSettings)
    for panel in _others():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister() -> None:
    """Called when the add-on is disabled."""
    for panel in _others():
        panel.COMPAT_ENGINES.discard(ENGINE)
    del bpy.types.Scene.farlight
    for one in reversed(_CLASSES):
        bpy.utils.unregister_class(one)
