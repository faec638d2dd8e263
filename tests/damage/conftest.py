import numpy as np
import pytest

from wearsim.contact.patch import SurfaceFields
from wearsim.damage.fatigue.loads import PatchLoads


@pytest.fixture
def patches():
    """Make fields of three patches, sticking ahead and sliding behind; the last one
    does not slide.
    """

    def make(peak):
        m, nx, ny = 3, 20, 16
        rng = np.random.default_rng(7)
        local = (np.arange(ny) + 0.5) / ny * 2 - 1
        cells = np.zeros((m, nx, ny))
        work = peak * rng.random((m, nx, ny))
        work[:, : nx // 3] = 0.0
        work[1, :, : ny // 4] = 0.0  # strips without any slip
        work[2] = 0.0
        half_length = 5e-3 * np.sqrt(1 - local**2)
        slides = work > 0.0
        fields = SurfaceFields(
            pressure=cells + 1e9,
            shear_x=np.where(slides, -3e8, -1e8),
            shear_y=cells,
            slip_x=work / 3e8,
            slip_y=cells,
            work_density=work,
            x_lead=np.broadcast_to(half_length, (m, ny)).copy(),
            cell_length=np.broadcast_to(2 * half_length / nx, (m, ny)).copy(),
            strip_width=np.array([0.5e-3, 0.3e-3, 0.4e-3]),
            speed=np.full(m, 20.0),
        )
        area = (fields.cell_length.sum(axis=1) * nx) * fields.strip_width
        return fields, area

    return make


@pytest.fixture
def loads(patches):
    """Make the loads of the same three patches; the last one neither slips nor
    creeps.
    """

    def make(peak):
        fields, area = patches(peak)
        cell_area = (fields.cell_length * fields.strip_width[:, None])[:, None, :]
        normal = (fields.pressure * cell_area).sum(axis=(1, 2))
        force_x = (fields.shear_x * cell_area).sum(axis=(1, 2))
        work = fields.strip_work.sum(axis=1) * fields.strip_width
        spinning = 0.25 * work  # a quarter of the work is that of spin
        strips = fields.cell_length.shape[1]
        across = (np.arange(strips) - 0.5 * (strips - 1))[None] * fields.strip_width[
            :, None
        ]
        return PatchLoads(
            normal_force=normal,
            force_x=force_x,
            force_y=np.zeros(3),
            spin_moment=np.array([-2.0, 2.0, 0.0]),
            creepage_x=-(work - spinning) / force_x,
            creepage_y=np.zeros(3),
            spin=np.array([0.5, -0.5, 0.0]) * spinning,
            max_pressure=fields.pressure.max(axis=(1, 2)),
            area=area,
            y=across,
            fields=fields,
        )

    return make
