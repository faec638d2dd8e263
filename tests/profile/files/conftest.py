import pytest

from wearsim.errors import ProfileError
from wearsim.profile.files import read_profile


@pytest.fixture
def read(tmp_path):
    def reading(lines, kind="wheel", name="p.txt", **statements):
        path = tmp_path / name
        path.write_text("\n".join(lines))
        return read_profile(path, kind, **statements)

    return reading


@pytest.fixture
def fault(read, tmp_path):
    """Message of a file that cannot be read, without its folder."""

    def message(*args, **kwargs):
        with pytest.raises(ProfileError) as caught:
            read(*args, **kwargs)
        return str(caught.value).replace(f"{tmp_path}/", "")

    return message
