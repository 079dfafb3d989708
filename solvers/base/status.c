/* Names and texts of the status codes, and the version. */
#include <batten/base.h>

#define STRING(x) #x
#define STRING_OF(x) STRING(x)

const char *batten_status_name(batten_status status) {
  switch (status) {
#define CASE(name, value, text) \
  case name: return #name;
    BATTEN_STATUS_LIST(CASE)
#undef CASE
  }
  return "unknown status";
}

const char *batten_status_text(batten_status status) {
  switch (status) {
#define CASE(name, value, text) \
  case name: return text;
    BATTEN_STATUS_LIST(CASE)
#undef CASE
  }
  return "unknown status";
}

const char *batten_version(void) {
  return STRING_OF(BATTEN_VERSION_MAJOR) "." STRING_OF(BATTEN_VERSION_MINOR) "." STRING_OF(BATTEN_VERSION_PATCH);
}
