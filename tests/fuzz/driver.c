/* The fuzzers' corpus without libFuzzer: every file, every shorter beginning of it, and mutations that are the same
 * each time; in blocks of exact size, so that a sanitizer sees a byte too far.
 *   driver FOLDER [MUTATIONS]
 * A file that once broke a reader is kept in the folder. */
#include "fuzz.h"

#include "tap.h"

#include <dirent.h>

enum { SIZE_MAX_READ = 1 << 16, PREFIX_MAX = 600 };

static const char *try_bytes(const char *name, const unsigned char *bytes, size_t size) {
  unsigned char *exact = malloc(size ? size : 1);
  if (size) memcpy(exact, bytes, size);
  const char *wrong = fuzz_read(name, exact, size);
  free(exact);
  return wrong;
}

static size_t mutate(uint64_t *seed, unsigned char *bytes, size_t size, size_t room) {
  static const char *const pieces[] = {
      "2147483648", "-1",   "nan", "1e400", "0",  " ",      "\n", "4294967295", "99999999999999999999", ",", ";",
      "/",          "\\\n", "[",   "{",     "\"", "1e-400", "#",  "f 1 2 3\n",  "end_header\n"};
  unsigned rounds = 1 + (unsigned)(t_random(seed) % 4);
  for (unsigned i = 0; i < rounds && size; i++) {
    size_t at = t_random(seed) % size, other = t_random(seed) % size, length;
    switch (t_random(seed) % 7) {
      case 0:
        bytes[at] ^= (unsigned char)(1u << (t_random(seed) % 8));
        break;
      case 1:
        bytes[at] = (unsigned char)t_random(seed);
        break;
      case 2:
        bytes[at] = t_random(seed) % 2 ? 0xff : 0;
        break;
      case 3:
        size = at;
        break;
      case 4: /* out */
        length = t_random(seed) % (size - at) % 40;
        memmove(bytes + at, bytes + at + length, size - at - length);
        size -= length;
        break;
      case 5: { /* a piece in */
        const char *piece = pieces[t_random(seed) % (sizeof pieces / sizeof pieces[0])];
        length = strlen(piece);
        if (size + length > room) break;
        memmove(bytes + at + length, bytes + at, size - at);
        memcpy(bytes + at, piece, length);
        size += length;
        break;
      }
      default: /* from one place to another */
        length = t_random(seed) % 24;
        if (at + length <= size && other + length <= size) memmove(bytes + at, bytes + other, length);
    }
  }
  return size;
}

static void run_file(const char *folder, const char *name, size_t mutations) {
  char path[1024];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *f = fopen(path, "rb");
  unsigned char *bytes = malloc(SIZE_MAX_READ), *changed = malloc(2 * SIZE_MAX_READ);
  size_t size = f ? fread(bytes, 1, SIZE_MAX_READ, f) : 0, tried = 0;
  if (f) fclose(f);
  const char *wrong = f ? try_bytes(name, bytes, size) : "cannot be opened";
  size_t step = 1 + size / PREFIX_MAX;
  for (size_t cut = 0; !wrong && cut < size; cut += step, tried++) wrong = try_bytes(name, bytes, cut);
  uint64_t seed = 1;
  for (const char *c = name; *c; c++) seed = seed * 31 + (unsigned char)*c;
  for (size_t i = 0; !wrong && i < mutations; i++, tried++) {
    memcpy(changed, bytes, size);
    wrong = try_bytes(name, changed, mutate(&seed, changed, size, 2 * SIZE_MAX_READ));
  }
  T_CHECK(!wrong, "%s and %zu beginnings and mutations of it: %s", name, tried, wrong ? wrong : "safe");
  free(bytes);
  free(changed);
}

int main(int argc, char **argv) {
  DIR *folder = argc > 1 ? opendir(argv[1]) : NULL;
  if (!T_CHECK(folder, "the corpus is there")) return t_done();
  struct dirent *entry;
  while ((entry = readdir(folder)))
    if (entry->d_name[0] != '.') run_file(argv[1], entry->d_name, argc > 2 ? strtoul(argv[2], NULL, 10) : 200);
  closedir(folder);
  return t_done();
}
