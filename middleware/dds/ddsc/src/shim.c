/* What the Rust side needs of Cyclone DDS, over plain C types.
 *
 * A topic here carries bytes: its "type" in the library (a sertype with its serdata) keeps the serialised form of a
 * sample and looks at nothing but the four bytes of the RTPS encapsulation before it (RTPS 2.5, 10.2). So one library
 * type serves every type of ours, and a sample is copied once on each side. A topic has no key.
 *
 * Everything that can fail returns a negative code of dds_public_error.h.
 */

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "dds/dds.h"
#include "dds/ddsi/ddsi_domaingv.h"
#include "dds/ddsi/ddsi_entity_index.h"
#include "dds/ddsi/ddsi_proxy_endpoint.h"
#include "dds/ddsi/ddsi_radmin.h"
#include "dds/ddsi/ddsi_serdata.h"
#include "dds/ddsi/ddsi_sertype.h"
#include "dds/ddsi/ddsi_thread.h"
#include "dds/ddsrt/ifaddrs.h"
#include "dds/ddsrt/log.h"
#include "dds/ddsrt/sockets.h"
#include "dds__entity.h"
#include "dds__guid.h"
#include "dds__writer.h"
#include "ddsi__endpoint.h"
#include "ddsi__hbcontrol.h"
#include "ddsi__xevent.h"
#include "ddsi__xmsg.h"

/* ---- Samples ---- */

/* Memory of large samples. The heap would keep many times what is in use: samples of differing sizes are made and given
 * up by different threads, with small ones between them. Fresh pages for each sample would cost more than all else that is
 * done with it. So regions of their own are used again; few are kept. */

enum { LARGE = 128 * 1024, MOST_KEPT = 8, MOST_BYTES_KEPT = 16 * 1024 * 1024 };

static struct {
  pthread_mutex_t lock;
  size_t bytes;
  uint32_t count;
  struct {
    void *memory;
    size_t room;
  } free[MOST_KEPT]; /* the last one that was given up is the next one that is used */
} regions = { .lock = PTHREAD_MUTEX_INITIALIZER };

/* At least `size` bytes; `room`: how many there are. */
static void *region_new (size_t size, size_t *room)
{
  void *memory = NULL;
  pthread_mutex_lock (&regions.lock);
  for (uint32_t i = regions.count; i-- > 0 && memory == NULL;) {
    if (regions.free[i].room >= size && regions.free[i].room / 2 <= size) {
      memory = regions.free[i].memory;
      *room = regions.free[i].room;
      regions.bytes -= *room;
      regions.count--;
      memmove (&regions.free[i], &regions.free[i + 1], (regions.count - i) * sizeof (regions.free[0]));
    }
  }
  pthread_mutex_unlock (&regions.lock);
  if (memory != NULL)
    return memory;
  /* Somewhat larger than this sample, so that the next one, which is of another size, finds room, too. */
  *room = (size + size / 8 + LARGE - 1) / LARGE * LARGE;
  memory = mmap (NULL, *room, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  return memory == MAP_FAILED ? NULL : memory;
}

static void region_free (void *memory, size_t room)
{
  pthread_mutex_lock (&regions.lock);
  const bool keep = regions.count < MOST_KEPT && regions.bytes + room <= MOST_BYTES_KEPT;
  if (keep) {
    regions.free[regions.count].memory = memory;
    regions.free[regions.count].room = room;
    regions.bytes += room;
    regions.count++;
  }
  pthread_mutex_unlock (&regions.lock);
  if (!keep)
    munmap (memory, room);
}

/* SampleIdentity_t (RTPS 2.5, 9.3.1.10): a GUID and a sequence number, which relate a reply to its request. */
struct identity {
  uint8_t guid[16];
  int32_t high;
  uint32_t low;
};

/* A sample as it is on the wire, encapsulation included. */
struct blob {
  struct ddsi_serdata c;
  uint64_t sequence; /* of its writer */
  bool is_related;   /* whether there is an identity */
  struct identity identity;
  size_t room;       /* of the region that it is in; 0: it is in the heap */
  uint32_t size;     /* of `bytes` */
  uint8_t padding;   /* at the end of a body of this process */
  uint8_t *bytes;    /* in `memory` */
  _Alignas (8) uint8_t memory[];
};

/* Before `bytes` there is room in which this process may put what belongs before a body: with the encapsulation, 40 bytes. So a
 * body can get an envelope without a copy. */
enum { ENCAPSULATION = 4, HEADROOM = 36 };

/* RTPS 2.5, 9.4.5.3 Data and 9.4.5.4 DataFrag begin alike: header (4), extra flags (2), distance to the inline QoS (2),
 * reader (4), writer (4), writer's sequence number: high (4), low (4). The library has turned the numbers into those of
 * this machine when a sample is made from them. */
enum { SEQUENCE_HIGH = 16, SEQUENCE_LOW = 20 };

static struct blob *blob_new (const struct ddsi_sertype *type, enum ddsi_serdata_kind kind, size_t size)
{
  if (size > UINT32_MAX - sizeof (struct blob) - HEADROOM - 3)
    return NULL;
  const size_t padded = (size + 3) & ~(size_t) 3;
  const size_t whole = sizeof (struct blob) + HEADROOM + padded;
  size_t room = 0;
  struct blob *d = whole < LARGE ? malloc (whole) : region_new (whole, &room);
  if (d == NULL)
    return NULL;
  d->room = room;
  ddsi_serdata_init (&d->c, type, kind);
  d->c.hash = type->serdata_basehash;
  d->sequence = 0;
  d->is_related = false;
  d->size = (uint32_t) size;
  d->padding = 0;
  d->bytes = d->memory + HEADROOM;
  memset (d->memory, 0, HEADROOM);
  memset (d->bytes + size, 0, padded - size);
  return d;
}

static void blob_free (struct ddsi_serdata *c)
{
  struct blob *d = (struct blob *) c;
  if (d->room == 0)
    free (d);
  else
    region_free (d, d->room);
}

static bool blob_eqkey (const struct ddsi_serdata *a, const struct ddsi_serdata *b)
{
  (void) a;
  (void) b;
  return true;
}

static uint32_t blob_size (const struct ddsi_serdata *c)
{
  return ((const struct blob *) c)->size;
}

/* PID_RELATED_SAMPLE_IDENTITY: in RTPS 2.5, and what Fast DDS reads and writes. */
enum { RELATED = 0x0083, RELATED_OF_FAST = 0x800f, SENTINEL = 1 };

/* Reads the identity in the inline QoS of a submessage (RTPS 2.5, 9.4.2.11), which is between the header and the payload, in
 * the byte order of the submessage. The library has checked the list before a sample is made. */
static void read_identity (struct blob *d, const struct ddsi_rdata *fragment)
{
  const size_t start = DDSI_RDATA_SUBMSG_OFF (fragment), end = DDSI_RDATA_PAYLOAD_OFF (fragment);
  const unsigned char *m = DDSI_RMSG_PAYLOADOFF (fragment->rmsg, 0);
  if (!(m[start + 1] & DDSI_DATA_FLAG_INLINE_QOS))
    return;
  const bool swap = (m[start + 1] & DDSI_RTPS_SUBMESSAGE_FLAG_ENDIANNESS) != (DDSRT_ENDIAN == DDSRT_LITTLE_ENDIAN);
  uint16_t distance; /* the library has turned it into a number of this machine */
  memcpy (&distance, m + start + 6, sizeof (distance));
  for (size_t at = start + 8 + distance; at + 4 <= end;) {
    uint16_t head[2];
    memcpy (head, m + at, sizeof (head));
    const uint16_t pid = swap ? ddsrt_bswap2u (head[0]) : head[0];
    const uint16_t length = swap ? ddsrt_bswap2u (head[1]) : head[1];
    at += sizeof (head);
    if (pid == SENTINEL || at + length > end)
      return;
    if ((pid == RELATED || pid == RELATED_OF_FAST) && length >= sizeof (d->identity)) {
      memcpy (&d->identity, m + at, sizeof (d->identity));
      if (swap) {
        d->identity.high = (int32_t) ddsrt_bswap4u ((uint32_t) d->identity.high);
        d->identity.low = ddsrt_bswap4u (d->identity.low);
      }
      d->is_related = true;
    }
    at += length;
  }
}

static struct ddsi_serdata *blob_from_ser (const struct ddsi_sertype *type, enum ddsi_serdata_kind kind, const struct ddsi_rdata *fragment, size_t size)
{
  struct blob *d = blob_new (type, kind, size);
  if (d == NULL)
    return NULL;
  if (fragment->submsg_zoff != 0) {
    const unsigned char *message = DDSI_RMSG_PAYLOADOFF (fragment->rmsg, DDSI_RDATA_SUBMSG_OFF (fragment));
    uint32_t low;
    int32_t high;
    memcpy (&high, message + SEQUENCE_HIGH, sizeof (high));
    memcpy (&low, message + SEQUENCE_LOW, sizeof (low));
    d->sequence = (uint64_t) (uint32_t) high << 32 | low;
    read_identity (d, fragment);
  }
  size_t filled = 0;
  for (; fragment != NULL; fragment = fragment->nextfrag) {
    const size_t end = fragment->maxp1 < size ? fragment->maxp1 : size;
    if (fragment->min > filled)
      break;
    if (end > filled) {
      const unsigned char *payload = DDSI_RMSG_PAYLOADOFF (fragment->rmsg, DDSI_RDATA_PAYLOAD_OFF (fragment));
      memcpy (d->bytes + filled, payload + (filled - fragment->min), end - filled);
      filled = end;
    }
  }
  if (filled < size) {
    blob_free (&d->c);
    return NULL;
  }
  return &d->c;
}

static struct ddsi_serdata *blob_from_ser_iov (const struct ddsi_sertype *type, enum ddsi_serdata_kind kind, ddsrt_msg_iovlen_t niov, const ddsrt_iovec_t *iov, size_t size)
{
  struct blob *d = blob_new (type, kind, size);
  if (d == NULL)
    return NULL;
  size_t filled = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < niov && filled < size; i++) {
    const size_t rest = size - filled;
    const size_t length = iov[i].iov_len < rest ? iov[i].iov_len : rest;
    memcpy (d->bytes + filled, iov[i].iov_base, length);
    filled += length;
  }
  if (filled < size) {
    blob_free (&d->c);
    return NULL;
  }
  return &d->c;
}

static struct ddsi_serdata *blob_from_keyhash (const struct ddsi_sertype *type, const struct ddsi_keyhash *hash)
{
  (void) hash;
  struct blob *d = blob_new (type, SDK_KEY, 0);
  return d == NULL ? NULL : &d->c;
}

/* Samples are made by rc_write only. */
static struct ddsi_serdata *blob_from_sample (const struct ddsi_sertype *type, enum ddsi_serdata_kind kind, const void *sample)
{
  (void) type;
  (void) kind;
  (void) sample;
  return NULL;
}

static void blob_to_ser (const struct ddsi_serdata *c, size_t offset, size_t size, void *buffer)
{
  memcpy (buffer, ((const struct blob *) c)->bytes + offset, size);
}

static struct ddsi_serdata *blob_to_ser_ref (const struct ddsi_serdata *c, size_t offset, size_t size, ddsrt_iovec_t *ref)
{
  ref->iov_base = (void *) (((const struct blob *) c)->bytes + offset);
  ref->iov_len = size;
  return ddsi_serdata_ref (c);
}

static void blob_to_ser_unref (struct ddsi_serdata *c, const ddsrt_iovec_t *ref)
{
  (void) ref;
  ddsi_serdata_unref (c);
}

static bool blob_to_sample (const struct ddsi_serdata *c, void *sample, void **buffer, void *limit)
{
  (void) c;
  (void) sample;
  (void) buffer;
  (void) limit;
  return false;
}

/* The library keeps one of these for each topic: it must not hold on to the bytes of a sample. */
static struct ddsi_serdata *blob_to_untyped (const struct ddsi_serdata *c)
{
  struct blob *d = blob_new (c->type, SDK_KEY, 0);
  if (d == NULL)
    abort (); /* the library has no way to be told, here as in its own types */
  d->c.type = NULL;
  return &d->c;
}

static bool blob_untyped_to_sample (const struct ddsi_sertype *type, const struct ddsi_serdata *c, void *sample, void **buffer, void *limit)
{
  (void) type;
  (void) c;
  (void) sample;
  (void) buffer;
  (void) limit;
  return false;
}

static size_t blob_print (const struct ddsi_sertype *type, const struct ddsi_serdata *c, char *buffer, size_t size)
{
  (void) type;
  (void) c;
  if (size > 0)
    buffer[0] = 0;
  return 0;
}

static void blob_keyhash (const struct ddsi_serdata *c, struct ddsi_keyhash *hash, bool force_md5)
{
  (void) c;
  (void) force_md5;
  memset (hash, 0, sizeof (*hash));
}

static const struct ddsi_serdata_ops blob_ops = {
  .eqkey = blob_eqkey,
  .get_size = blob_size,
  .from_ser = blob_from_ser,
  .from_ser_iov = blob_from_ser_iov,
  .from_keyhash = blob_from_keyhash,
  .from_sample = blob_from_sample,
  .to_ser = blob_to_ser,
  .to_ser_ref = blob_to_ser_ref,
  .to_ser_unref = blob_to_ser_unref,
  .to_sample = blob_to_sample,
  .to_untyped = blob_to_untyped,
  .untyped_to_sample = blob_untyped_to_sample,
  .free = blob_free,
  .print = blob_print,
  .get_keyhash = blob_keyhash,
};

/* What transmit.c asks of a sample. */

int rc_has_inline_qos (const struct ddsi_serdata *c)
{
  return c->ops == &blob_ops && ((const struct blob *) c)->is_related;
}

void rc_inline_qos (struct ddsi_xmsg *m, const struct ddsi_serdata *c)
{
  if (!rc_has_inline_qos (c))
    return;
  const struct identity *identity = &((const struct blob *) c)->identity;
  memcpy (ddsi_xmsg_addpar (m, RELATED, sizeof (*identity)), identity, sizeof (*identity));
  memcpy (ddsi_xmsg_addpar (m, RELATED_OF_FAST, sizeof (*identity)), identity, sizeof (*identity));
}

/* ---- Types ---- */

static void type_free (struct ddsi_sertype *type)
{
  ddsi_sertype_fini (type);
  free (type);
}

static void type_zero (const struct ddsi_sertype *type, void *samples, size_t count)
{
  (void) type;
  (void) samples;
  (void) count;
}

static void type_realloc (void **pointers, const struct ddsi_sertype *type, void *old, size_t old_count, size_t count)
{
  (void) type;
  (void) old;
  (void) old_count;
  for (size_t i = 0; i < count; i++)
    pointers[i] = NULL;
}

static void type_free_samples (const struct ddsi_sertype *type, void **pointers, size_t count, dds_free_op_t op)
{
  (void) type;
  (void) pointers;
  (void) count;
  (void) op;
}

/* The name is compared by the library. */
static bool type_equal (const struct ddsi_sertype *a, const struct ddsi_sertype *b)
{
  (void) a;
  (void) b;
  return true;
}

static uint32_t type_hash (const struct ddsi_sertype *type)
{
  (void) type;
  return 0;
}

static const struct ddsi_sertype_ops type_ops = {
  .version = ddsi_sertype_v0,
  .free = type_free,
  .zero_samples = type_zero,
  .realloc_samples = type_realloc,
  .free_samples = type_free_samples,
  .equal = type_equal,
  .hash = type_hash,
};

/* ---- Entities ---- */

/* `config`: fragments of Cyclone's XML and addresses of such files, separated by commas; later ones win. */
int32_t rc_domain (uint32_t id, const char *config)
{
  return dds_create_domain (id, config);
}

int32_t rc_participant (uint32_t domain, const uint8_t *user_data, size_t user_data_size)
{
  dds_qos_t *qos = dds_create_qos ();
  if (qos == NULL)
    return DDS_RETCODE_OUT_OF_RESOURCES;
  dds_qset_userdata (qos, user_data, user_data_size);
  const int32_t participant = dds_create_participant (domain, qos, NULL);
  dds_delete_qos (qos);
  return participant;
}

int32_t rc_topic (int32_t participant, const char *name, const char *type_name)
{
  struct ddsi_sertype *type = malloc (sizeof (*type));
  if (type == NULL)
    return DDS_RETCODE_OUT_OF_RESOURCES;
  ddsi_sertype_init (type, type_name, &type_ops, &blob_ops, true);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  const dds_entity_t topic = dds_create_topic_sertype (participant, name, &type, NULL, NULL, NULL);
  if (topic < 0)
    ddsi_sertype_unref (type);
  return topic;
}

int32_t rc_delete (int32_t entity)
{
  return dds_delete (entity);
}

int32_t rc_guid (int32_t entity, uint8_t guid[16])
{
  dds_guid_t found;
  const dds_return_t rc = dds_get_guid (entity, &found);
  if (rc == DDS_RETCODE_OK)
    memcpy (guid, found.v, sizeof (found.v));
  return rc;
}

const char *rc_error (int32_t code)
{
  return dds_strretcode (code);
}

/* ---- Quality of service ---- */

struct rc_qos {
  int32_t reliable;
  int32_t transient_local;
  int32_t depth;      /* 0: keep all */
  int64_t deadline;   /* nanoseconds; negative: none, here and below */
  int64_t lifespan;
  int64_t liveliness;
  const uint8_t *user_data;
  size_t user_data_size;
};

static dds_qos_t *qos_of (const struct rc_qos *wanted)
{
  dds_qos_t *qos = dds_create_qos ();
  if (qos == NULL)
    return NULL;
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation (qos, 1, &xcdr1);
  dds_qset_reliability (qos, wanted->reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_SECS (1));
  dds_qset_durability (qos, wanted->transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  const dds_history_kind_t history = wanted->depth > 0 ? DDS_HISTORY_KEEP_LAST : DDS_HISTORY_KEEP_ALL;
  dds_qset_history (qos, history, wanted->depth);
  if (wanted->transient_local)
    dds_qset_durability_service (qos, 0, history, wanted->depth, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  if (wanted->deadline >= 0)
    dds_qset_deadline (qos, wanted->deadline);
  if (wanted->lifespan >= 0)
    dds_qset_lifespan (qos, wanted->lifespan);
  if (wanted->liveliness >= 0)
    dds_qset_liveliness (qos, DDS_LIVELINESS_AUTOMATIC, wanted->liveliness);
  dds_qset_userdata (qos, wanted->user_data, wanted->user_data_size);
  return qos;
}

/* ---- What happens ---- */

enum rc_event {
  RC_DATA = 0,         /* something can be taken */
  RC_MATCHED = 1,      /* handle: the other end; number: 1 it is there, -1 it has gone */
  RC_INCOMPATIBLE = 2, /* number: the policy */
  RC_DEADLINE = 3,     /* number: how often a deadline was missed since the last time */
  RC_LIVELINESS = 4,   /* handle: the writer; number: 1 alive again, -1 not alive */
};

/* Called on threads of the library. */
typedef void (*rc_callback) (void *argument, int32_t event, uint64_t handle, int32_t number);

struct listener {
  rc_callback callback;
  void *argument;
};

/* dds_create_reader and dds_create_writer copy the listener, so its argument has to live as long as the entity: it is
 * the `struct listener` that the caller keeps. */

static void on_data (dds_entity_t reader, void *argument)
{
  (void) reader;
  const struct listener *l = argument;
  l->callback (l->argument, RC_DATA, 0, 0);
}

static void on_subscription_matched (dds_entity_t reader, const dds_subscription_matched_status_t status, void *argument)
{
  (void) reader;
  const struct listener *l = argument;
  l->callback (l->argument, RC_MATCHED, status.last_publication_handle, status.current_count_change);
}

static void on_publication_matched (dds_entity_t writer, const dds_publication_matched_status_t status, void *argument)
{
  (void) writer;
  const struct listener *l = argument;
  l->callback (l->argument, RC_MATCHED, status.last_subscription_handle, status.current_count_change);
}

static void on_requested_incompatible (dds_entity_t reader, const dds_requested_incompatible_qos_status_t status, void *argument)
{
  (void) reader;
  const struct listener *l = argument;
  l->callback (l->argument, RC_INCOMPATIBLE, 0, (int32_t) status.last_policy_id);
}

static void on_offered_incompatible (dds_entity_t writer, const dds_offered_incompatible_qos_status_t status, void *argument)
{
  (void) writer;
  const struct listener *l = argument;
  l->callback (l->argument, RC_INCOMPATIBLE, 0, (int32_t) status.last_policy_id);
}

static void on_deadline (dds_entity_t reader, const dds_requested_deadline_missed_status_t status, void *argument)
{
  (void) reader;
  const struct listener *l = argument;
  l->callback (l->argument, RC_DEADLINE, 0, status.total_count_change);
}

static void on_liveliness (dds_entity_t reader, const dds_liveliness_changed_status_t status, void *argument)
{
  (void) reader;
  const struct listener *l = argument;
  if (status.not_alive_count_change != 0)
    l->callback (l->argument, RC_LIVELINESS, status.last_publication_handle, status.not_alive_count_change > 0 ? -1 : 1);
}

/* `listener` stays where it is until the entity is deleted. */
int32_t rc_writer (int32_t participant, int32_t topic, const struct rc_qos *wanted, struct listener *listener)
{
  dds_qos_t *qos = qos_of (wanted);
  dds_listener_t *l = dds_create_listener (listener);
  int32_t writer = DDS_RETCODE_OUT_OF_RESOURCES;
  if (qos != NULL && l != NULL) {
    dds_qset_writer_data_lifecycle (qos, false);
    dds_lset_publication_matched (l, on_publication_matched);
    dds_lset_offered_incompatible_qos (l, on_offered_incompatible);
    writer = dds_create_writer (participant, topic, qos, l);
  }
  dds_delete_listener (l);
  dds_delete_qos (qos);
  return writer;
}

/* The same for a reader. */
int32_t rc_reader (int32_t participant, int32_t topic, const struct rc_qos *wanted, struct listener *listener)
{
  dds_qos_t *qos = qos_of (wanted);
  dds_listener_t *l = dds_create_listener (listener);
  int32_t reader = DDS_RETCODE_OUT_OF_RESOURCES;
  if (qos != NULL && l != NULL) {
    dds_lset_data_available (l, on_data);
    dds_lset_subscription_matched (l, on_subscription_matched);
    dds_lset_requested_incompatible_qos (l, on_requested_incompatible);
    dds_lset_requested_deadline_missed (l, on_deadline);
    dds_lset_liveliness_changed (l, on_liveliness);
    reader = dds_create_reader (participant, topic, qos, l);
  }
  dds_delete_listener (l);
  dds_delete_qos (qos);
  return reader;
}

/* ---- Data ---- */

/* A new sample with a body of `size` bytes, which the caller writes. NULL: no memory, or no writer. */
static struct blob *blob_of_writer (int32_t writer, size_t size)
{
  const struct ddsi_sertype *type;
  if (size > UINT32_MAX - 2 * ENCAPSULATION || dds_get_entity_sertype (writer, &type) != DDS_RETCODE_OK)
    return NULL;
  const uint8_t padding = (uint8_t) (-size & 3);
  struct blob *d = blob_new (type, SDK_DATA, ENCAPSULATION + size + padding);
  if (d == NULL)
    return NULL;
  d->padding = padding;
  memset (d->bytes + ENCAPSULATION + size, 0, padding);
  return d;
}

/* `sequence`: what readers in this process get; others get the writer's count, from 1. `stamp`: nanoseconds since 1970.
 * `related`: an identity, or NULL. The library takes the sample in any case. */
static int32_t send_blob (int32_t writer, struct blob *d, uint64_t sequence, int64_t stamp, const struct identity *related)
{
  d->sequence = sequence;
  if (related != NULL) {
    d->is_related = true;
    d->identity = *related;
  }
  d->c.statusinfo = 0;
  d->c.timestamp.v = stamp;
  return dds_forwardcdr (writer, &d->c);
}

/* CDR_LE, and how many bytes pad the body (RTPS 2.5, 10.2.1.2). */
static void encapsulate (struct blob *d)
{
  const uint8_t encapsulation[ENCAPSULATION] = { 0, 1, 0, d->padding };
  memcpy (d->bytes, encapsulation, sizeof (encapsulation));
}

int32_t rc_write (int32_t writer, uint64_t sequence, int64_t stamp, const uint8_t *body, size_t size)
{
  struct blob *d = blob_of_writer (writer, size);
  if (d == NULL)
    return DDS_RETCODE_OUT_OF_RESOURCES;
  encapsulate (d);
  if (size > 0)
    memcpy (d->bytes + ENCAPSULATION, body, size);
  return send_blob (writer, d, sequence, stamp, NULL);
}

/* The bytes begin with an encapsulation of their own: tests send what is wrong. */
int32_t rc_write_raw (int32_t writer, uint64_t sequence, int64_t stamp, const uint8_t *bytes, size_t size)
{
  struct blob *d = blob_of_writer (writer, size);
  if (d == NULL)
    return DDS_RETCODE_OUT_OF_RESOURCES;
  d->bytes += ENCAPSULATION;
  d->size = (uint32_t) size;
  if (size > 0)
    memcpy (d->bytes, bytes, size);
  return send_blob (writer, d, sequence, stamp, NULL);
}

/* A sample that the caller writes: its body of `size` bytes is at `body`, and HEADROOM + ENCAPSULATION bytes before it may be
 * written, too. All of it is initialised. It goes to rc_send or to rc_release. NULL: no memory, or no writer. */
struct ddsi_serdata *rc_loan (int32_t writer, size_t size, uint8_t **body)
{
  struct blob *d = blob_of_writer (writer, size);
  if (d == NULL)
    return NULL;
  /* A region has been written before, or was zero. */
  if (d->room == 0)
    memset (d->bytes, 0, ENCAPSULATION + size);
  *body = d->bytes + ENCAPSULATION;
  return &d->c;
}

/* Sends it. `before`: so many bytes before its body are a part of it, at most HEADROOM, and a multiple of 8. */
int32_t rc_send (int32_t writer, struct ddsi_serdata *c, uint64_t sequence, int64_t stamp, size_t before, const struct identity *related)
{
  struct blob *d = (struct blob *) c;
  d->bytes -= before;
  d->size += (uint32_t) before;
  encapsulate (d);
  return send_blob (writer, d, sequence, stamp, related);
}

enum { RC_AT_ONCE = 64 };

struct rc_sample {
  struct ddsi_serdata *data; /* to be given to rc_release */
  const uint8_t *bytes;
  size_t size;
  uint64_t sequence; /* of the writer, from 1 */
  uint64_t writer;   /* its handle */
  int64_t stamp;
  const struct identity *related; /* in `data`, or NULL */
};

/* Takes what is there, at most RC_AT_ONCE samples; those without data are passed over. `more`: whether there may be more. */
int32_t rc_take (int32_t reader, struct rc_sample samples[RC_AT_ONCE], int32_t *more)
{
  struct ddsi_serdata *data[RC_AT_ONCE];
  dds_sample_info_t info[RC_AT_ONCE];
  const dds_return_t taken = dds_takecdr (reader, data, RC_AT_ONCE, info, DDS_ANY_STATE);
  *more = taken == RC_AT_ONCE;
  if (taken < 0)
    return taken;
  int32_t count = 0;
  for (dds_return_t i = 0; i < taken; i++) {
    const struct blob *d = (const struct blob *) data[i];
    if (!info[i].valid_data || data[i]->kind != SDK_DATA) {
      ddsi_serdata_unref (data[i]);
      continue;
    }
    samples[count++] = (struct rc_sample) {
      .data = data[i],
      .bytes = d->bytes,
      .size = d->size,
      .sequence = d->sequence,
      .writer = info[i].publication_handle,
      .stamp = info[i].source_timestamp,
      .related = d->is_related ? &d->identity : NULL,
    };
  }
  return count;
}

void rc_release (struct ddsi_serdata *data)
{
  ddsi_serdata_unref (data);
}

/* Whether the caller alone holds a sample of rc_take, so that it may write to it. */
int32_t rc_is_unique (const struct ddsi_serdata *data)
{
  const struct blob *d = (const struct blob *) data;
  /* A sample of a writer in this process may begin in its headroom (`rc_send`). */
  const bool is_unique = ddsrt_atomic_ld32 (&data->refc) == 1 && d->bytes - d->memory >= HEADROOM;
  /* What others read before they let go of it was read before this. */
  ddsrt_atomic_fence_acq ();
  return is_unique;
}

/* Asks the readers of a writer to confirm what was sent. By itself the library asks them with its next heartbeat, which may be 100 ms
 * away: it sends one with a sample only after a pause. */
static void ask_for_acks (struct ddsi_writer *wr)
{
  struct ddsi_domaingv *gv = wr->e.gv;
  if (!wr->reliable)
    return;
  ddsi_thread_state_awake (ddsi_lookup_thread_state (), gv);
  ddsrt_mutex_lock (&wr->e.lock);
  struct ddsi_whc_state state;
  ddsi_whc_get_state (wr->whc, &state);
  if (ddsi_writer_must_have_hb_scheduled (wr, &state)) {
    struct ddsi_xmsg *heartbeat =
      ddsi_writer_hbcontrol_create_heartbeat (wr, &state, ddsrt_time_monotonic (), DDSI_HBC_ACK_REQ_YES_AND_FLUSH, 1);
    if (heartbeat != NULL)
      ddsi_qxev_msg (wr->evq, heartbeat);
  }
  ddsrt_mutex_unlock (&wr->e.lock);
  ddsi_thread_state_asleep (ddsi_lookup_thread_state ());
}

/* `reader`: the only one that is waited for, or NULL for all. */
int32_t rc_wait_for_acks (int32_t writer, int64_t nanoseconds, const uint8_t *reader)
{
  ddsi_guid_t guid;
  if (reader != NULL) {
    dds_guid_t found;
    memcpy (found.v, reader, sizeof (found.v));
    guid = dds_guid_to_ddsi_guid (found);
  }
  dds_entity *e;
  dds_return_t rc = dds_entity_pin (writer, &e);
  if (rc != DDS_RETCODE_OK)
    return rc;
  rc = DDS_RETCODE_ILLEGAL_OPERATION;
  if (dds_entity_kind (e) == DDS_KIND_WRITER) {
    struct dds_writer *wr = (struct dds_writer *) e;
    ddsi_guid_t *const of = reader == NULL ? NULL : &guid;
    const ddsrt_mtime_t begin = ddsrt_time_monotonic ();
    rc = dds__ddsi_writer_wait_for_acks (wr, of, begin);
    if (rc == DDS_RETCODE_TIMEOUT) {
      ask_for_acks (wr->m_wr);
      rc = dds__ddsi_writer_wait_for_acks (wr, of, ddsrt_mtime_add_duration (begin, nanoseconds));
    }
  }
  dds_entity_unpin (e);
  return rc;
}

/* ---- Other ends ---- */

struct rc_end {
  uint8_t guid[16];
  uint8_t participant[16];
  int32_t reliable;
  int32_t transient_local;
  int64_t deadline;   /* nanoseconds; INT64_MAX: none, here and below */
  int64_t lifespan;
  int64_t liveliness;
  const char *topic;
  const char *type;
  const uint8_t *user_data;
  size_t user_data_size;
};

typedef void (*rc_end_callback) (void *argument, const struct rc_end *end, int32_t alive);

static void tell_end (const dds_builtintopic_endpoint_t *found, bool alive, rc_end_callback callback, void *argument)
{
  struct rc_end end = { .topic = "", .type = "", .deadline = DDS_INFINITY, .lifespan = DDS_INFINITY, .liveliness = DDS_INFINITY };
  memcpy (end.guid, found->key.v, sizeof (end.guid));
  void *user_data = NULL;
  /* Of one that has gone only the key is known. */
  if (alive && found->qos != NULL) {
    memcpy (end.participant, found->participant_key.v, sizeof (end.participant));
    end.topic = found->topic_name;
    end.type = found->type_name;
    dds_reliability_kind_t reliability;
    if (dds_qget_reliability (found->qos, &reliability, NULL))
      end.reliable = reliability == DDS_RELIABILITY_RELIABLE;
    dds_durability_kind_t durability;
    if (dds_qget_durability (found->qos, &durability))
      end.transient_local = durability != DDS_DURABILITY_VOLATILE;
    dds_qget_deadline (found->qos, &end.deadline);
    dds_qget_lifespan (found->qos, &end.lifespan);
    dds_qget_liveliness (found->qos, NULL, &end.liveliness);
    size_t size = 0;
    if (dds_qget_userdata (found->qos, &user_data, &size) && user_data != NULL) {
      end.user_data = user_data;
      end.user_data_size = size;
    }
  }
  callback (argument, &end, alive);
  dds_free (user_data);
}

/* Whether samples of this writer are taken by now. The library says that a reader and a remote writer have found each
 * other while it still looks for further readers, and drops samples until it has done; and where one of the readers is
 * reliable, until it has seen a heartbeat of the writer, also for those readers that will not get the samples again. */
static bool is_taken (dds_entity_t reader, const dds_guid_t *writer, bool again)
{
  dds_entity *e;
  if (dds_entity_pin (reader, &e) != DDS_RETCODE_OK)
    return true;
  struct ddsi_domaingv *gv = &e->m_domain->gv;
  const ddsi_guid_t guid = dds_guid_to_ddsi_guid (*writer);
  bool taken = true;
  ddsi_thread_state_awake (ddsi_lookup_thread_state (), gv);
  struct ddsi_proxy_writer *pwr = ddsi_entidx_lookup_proxy_writer_guid (gv->entity_index, &guid);
  if (pwr != NULL) {
    ddsrt_mutex_lock (&pwr->e.lock);
    taken = !pwr->local_matching_inprogress && (again || pwr->have_seen_heartbeat || pwr->n_reliable_readers == 0);
    ddsrt_mutex_unlock (&pwr->e.lock);
  }
  ddsi_thread_state_asleep (ddsi_lookup_thread_state ());
  dds_entity_unpin (e);
  return taken;
}

/* How long to wait for a writer, in milliseconds; and of each thread, for all writers within a time: strangers that stay silent do
 * not stop the thread. */
enum { PATIENCE = 200, ALL_PATIENCE = 1000, PATIENCE_WINDOW = 10000 };

static void await_taken (dds_entity_t reader, const dds_guid_t *writer, bool again)
{
  static _Thread_local int64_t window_begun;
  static _Thread_local int waited_in_window;
  const int64_t now = ddsrt_time_monotonic ().v;
  if (window_begun == 0 || now - window_begun > DDS_MSECS (PATIENCE_WINDOW)) {
    window_begun = now;
    waited_in_window = 0;
  }
  for (int waited = 0; waited < PATIENCE && waited_in_window < ALL_PATIENCE && !is_taken (reader, writer, again); waited++, waited_in_window++)
    dds_sleepfor (DDS_MSECS (1));
}

enum rc_kind { RC_WRITER = 0, RC_READER = 1, RC_RELIABLE_READER = 2 };

/* Tells about the other end of `entity`, which is of this kind, with this handle; 0 where there is none any more. Of a
 * writer it is told when its samples are taken. */
int32_t rc_matched (int32_t entity, uint64_t handle, int32_t kind, rc_end_callback callback, void *argument)
{
  dds_builtintopic_endpoint_t *found =
    kind != RC_WRITER ? dds_get_matched_publication_data (entity, handle) : dds_get_matched_subscription_data (entity, handle);
  if (found == NULL)
    return 0;
  const bool again = kind == RC_RELIABLE_READER;
  if (kind != RC_WRITER)
    await_taken (entity, &found->key, again);
  tell_end (found, true, callback, argument);
  dds_builtintopic_free_endpoint (found);
  return 1;
}

/* A reader of what the library has discovered: publications or subscriptions, its own ones included. */
int32_t rc_discovery (int32_t participant, int32_t publications, struct listener *listener)
{
  dds_listener_t *l = dds_create_listener (listener);
  if (l == NULL)
    return DDS_RETCODE_OUT_OF_RESOURCES;
  dds_lset_data_available (l, on_data);
  const dds_entity_t topic = publications ? DDS_BUILTIN_TOPIC_DCPSPUBLICATION : DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION;
  const int32_t reader = dds_create_reader (participant, topic, NULL, l);
  dds_delete_listener (l);
  return reader;
}

/* Tells what has changed: an end that has come or has other properties now, or one that has gone. */
int32_t rc_take_discovered (int32_t reader, rc_end_callback callback, void *argument)
{
  enum { AT_ONCE = 32 };
  for (;;) {
    void *samples[AT_ONCE] = { NULL };
    dds_sample_info_t info[AT_ONCE];
    const dds_return_t count = dds_take (reader, samples, info, AT_ONCE, AT_ONCE);
    if (count <= 0)
      return count;
    for (dds_return_t i = 0; i < count; i++) {
      const bool alive = info[i].valid_data && info[i].instance_state == DDS_ALIVE_INSTANCE_STATE;
      tell_end (samples[i], alive, callback, argument);
    }
    const dds_return_t rc = dds_return_loan (reader, samples, count);
    if (rc != DDS_RETCODE_OK)
      return rc;
  }
}

/* ---- The rest ---- */

/* Tells the names of this machine's network interfaces, and their addresses. */
int32_t rc_interfaces (void (*callback) (void *argument, const char *name, const char *address), void *argument)
{
  const int families[] = { AF_INET, DDSRT_AF_TERM };
  ddsrt_ifaddrs_t *found = NULL;
  const dds_return_t rc = ddsrt_getifaddrs (&found, families);
  if (rc != DDS_RETCODE_OK)
    return rc;
  for (const ddsrt_ifaddrs_t *i = found; i != NULL; i = i->next) {
    char address[64] = "";
    if (i->addr != NULL && ddsrt_sockaddrtostr (i->addr, address, sizeof (address)) < 0)
      address[0] = 0;
    callback (argument, i->name, address);
  }
  ddsrt_freeifaddrs (found);
  return DDS_RETCODE_OK;
}

/* What the library logs goes to `callback`, a line at a time; priority: 1 a warning, 2 worse. Of the whole process. */
static void (*log_callback) (int32_t priority, const char *message, size_t size);

static void on_log (void *argument, const dds_log_data_t *data)
{
  (void) argument;
  const int32_t priority = (data->priority & (DDS_LC_ERROR | DDS_LC_FATAL)) != 0 ? 2 : 1;
  log_callback (priority, data->message, data->size);
}

void rc_log (void (*callback) (int32_t priority, const char *message, size_t size))
{
  log_callback = callback;
  dds_set_log_sink (on_log, NULL);
}
