"""Many sheets at once: a design of factors, its tasks run on Dask, results that outlive a crash, reports.

What one task computes is a function that is named as "module:function", so that workers elsewhere find it;
this package knows no sheet and no machine. ``cluster``, ``run`` and ``work`` import dask, ``store`` and
``tables`` pyarrow.
"""

from studies.design import Factor, Study, Vocabulary, read_study, shipped
from studies.errors import StudyError

__all__ = ["Factor", "Study", "StudyError", "Vocabulary", "read_study", "shipped"]
