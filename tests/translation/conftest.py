import pytest

from wearsim.results import open_results


@pytest.fixture(scope="session")
def campaign_files(tmp_path_factory, write_campaign):
    """Rig: 6 steps, 20 nm/km deep; field: 9 steps at 8 nm/km."""
    folder = tmp_path_factory.mktemp("campaigns")
    return (
        write_campaign(folder / "rig.nc", "rig", 6, 20e-9),
        write_campaign(folder / "field.nc", "field", 9, 8e-9),
    )


@pytest.fixture(scope="session")
def rig(campaign_files):
    with open_results(campaign_files[0]) as data:
        return data.load()


@pytest.fixture(scope="session")
def field(campaign_files):
    with open_results(campaign_files[1]) as data:
        return data.load()
