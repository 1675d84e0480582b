"""From a case to the objects that compute it: these modules alone know every class."""
