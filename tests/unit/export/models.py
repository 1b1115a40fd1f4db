"""Models that are exported in the tests: one for each way in which a model acts on a block."""

from __future__ import annotations

import tomllib

from station.export import export_model, model_formats
from station.export.exported import ExportedFile
from station.export.from_model import NamedModel
from station.physics.catalogue import catalogue
from station.physics.model import Model, model_of_table

TEXTS = {
    "plain": "",
    "static_and_kinetic": "[effects.contact_aging]\nper_decade = 0.05\n[effects.kinetic_drop]\ndrop = 0.1",
    "grain": "[effects.plate_anisotropy]\ncos2 = 0.3\nsin2 = 0.2",
    "speed_law": "[effects.stribeck]\ndrop = 0.2\nspeed_m_s = 0.02\n[effects.viscous]\ndrag_n_s_m = 0.01",
    "forces": "[effects.adhesion]\nforce_n = 0.02\n[effects.platform_level]\neps_x_rad = 0.02\neps_y_rad = -0.01",
}
CREEPS = "[effects.solver_creep]\ntime_s = 0.0002"
TURNS = "[effects.uneven_contact]\nx_m = 0.001\ny_m = 0.0005"


def model_of(text: str) -> Model:
    """The model with these effects at a friction of 0.36."""
    return model_of_table(tomllib.loads(f"[friction]\nmu_s = 0.36\n{text}"), catalogue())


def file_of(stem: str, model: Model, name: str) -> ExportedFile:
    """The one file of a model in a format of Python."""
    assert name in model_formats()
    (file,) = export_model(NamedModel(stem, model), name)
    return file
